// The learner: one result for any instruction set, any number of threads, whatever runs beside it, and after a restart.
#include "learn/lanes/learner.hpp"

#include <gtest/gtest.h>

#include <atomic>

#include "determinism/tried.hpp"
#include "flappy/batch.hpp"
#include "learn/lanes/learners.hpp"
#include "sim/storage.hpp"

namespace flappy::learn {
namespace {

struct Case {
  const char* name;
  LearnerOptions options;
  std::uint64_t golden_float, golden_double;
};

/// 17 chunks are more than there are parts of the gradients.
std::vector<Case> cases() {
  LearnerOptions many = ddpg(kPlain), huber = td3(kPlain);
  many.batch = 17 * kChunk;
  many.actor_hidden = {16};
  many.critic_hidden = {24};
  huber.huber = 0.5;
  return {{"td3", td3(kWide), 0xcc5a6fcfb381e5af, 0x76f1571173c1a4da},
          {"ddpg", many, 0x4d7ac9b0f0fcbaf0, 0xd171fbb8277f2b65},
          {"huber", huber, 0x18d717264c53828c, 0xe001f25fd5ce2200}};
}

template <class T>
std::uint64_t hash(const Learner<T>& learner) {
  std::uint64_t h = 0;
  for (const T x : learner.numbers()) h = sim::mixed(h, sim::bits_of(x));
  for (const double x : {learner.metrics().critic_loss, learner.metrics().mean_q, learner.metrics().actor_q})
    h = sim::mixed(h, sim::bits_of(x));
  return h;
}

template <class T>
void train(Learner<T>& learner, const Replay& replay, int updates, const ParallelWork& beside = {}) {
  for (int i = 0; i < updates; ++i) learner.update(replay, 3e-4, 1e-3, beside);
}

constexpr int kUpdates = 4;

template <class T>
void one_result(const Case& c) {
  const Replay replay = random_replay(c.options.shape, 500);
  const std::uint64_t golden = sizeof(T) == sizeof(float) ? c.golden_float : c.golden_double;
  LearnerOptions o = c.options;
  for (const std::string& set : test::instruction_sets())
    for (const int threads : {1, 2, 3})
      for (const std::size_t beside : {0U, 7U}) {
        // once is enough for the others, of which two emulate fused multiply-adds
        if (set != sim::best_instruction_set() && (threads != 2 || beside == 0)) continue;
        o.instruction_set = set;
        o.threads = threads;
        Learner<T> learner(o);
        std::vector<std::atomic<int>> ran(beside);
        train(learner, replay, kUpdates, {beside, [&](std::size_t i) { ++ran[i]; }});
        EXPECT_EQ(hash(learner), golden) << c.name << ", " << set << ", " << threads << " threads, " << beside
                                         << " beside: 0x" << std::hex << hash(learner);
        for (const auto& times : ran) EXPECT_EQ(times, kUpdates);
      }
}

TEST(LearnerBits, one_result_in_float) {
  for (const Case& c : cases()) one_result<float>(c);
}
TEST(LearnerBits, one_result_in_double) {
  for (const Case& c : cases()) one_result<double>(c);
}

TEST(LearnerBits, a_restart_changes_nothing) {
  const Replay replay = random_replay(kWide, 500);
  Learner<float> whole(td3(kWide)), half(td3(kWide));
  train(whole, replay, 7);
  train(half, replay, 4);
  LearnerOptions o = td3(kWide);
  o.threads = 2;
  Learner<float> resumed(o);
  Replay again(kWide, 500);
  again.restore(replay.rows(), replay.cursor());
  std::ranges::copy(half.numbers(), resumed.numbers().begin());
  resumed.counters() = half.counters();
  train(resumed, again, 3);
  EXPECT_EQ(hash(resumed), hash(whole));
  resumed.counters() = {};
  train(resumed, again, 1);
  train(whole, replay, 1);
  EXPECT_NE(hash(resumed), hash(whole));
}

}  // namespace
}  // namespace flappy::learn
