#include "bench_learner.hpp"

#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#ifdef FLAPPY_HAVE_TORCH
#include "learn/engine.hpp"
#include "torch_peer.hpp"
#endif

namespace flappy::bench {
namespace {

using learn::Learner;
using learn::LearnerOptions;
using learn::Replay;

constexpr learn::TransitionShape kShape{24, 4};
constexpr std::size_t kTransitions = 200'000;  // larger than the caches
constexpr double kRate = 1e-4;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Number of weights of a network with biases, which equals the multiply-adds of a forward pass of one sample.
double weights(int inputs, const std::vector<int>& hidden, int outputs) {
  double sum = 0;
  for (const int w : hidden) sum += (inputs + 1.0) * w, inputs = w;
  return sum + (inputs + 1.0) * outputs;
}

/// Each weight is used once in a forward pass, once for the gradient by weights, and, except in the first layer, once for the gradient
/// by inputs.
double multiply_adds(const LearnerOptions& o) {
  const int in = o.shape.observation, critic_in = in + o.shape.action, critics = o.twin ? 2 : 1;
  const double actor = weights(in, o.actor_hidden, o.shape.action), critic = weights(critic_in, o.critic_hidden, 1);
  const double actor_first = (in + 1.0) * o.actor_hidden[0], critic_first = (critic_in + 1.0) * o.critic_hidden[0];
  const double goal = actor + critics * critic, descent = critics * (3 * critic - critic_first);
  const double to_action = critic - critic_first + o.shape.action * o.critic_hidden[0];
  const double ascent = 3 * actor - actor_first + critic + to_action;
  return static_cast<double>(o.batch) * (goal + descent + ascent / o.policy_delay);
}

/// Runs `update` for about `seconds` and returns how often it ran per second.
double per_second(double seconds, double (*clock)(), const std::function<void()>& update) {
  update();
  const double start = clock();
  double spent = 0;
  for (int done = 0;;) {
    for (int i = 0; i < 4; ++i, ++done) update();
    spent = clock() - start;
    if (spent >= seconds) return done / spent;
  }
}

#ifdef FLAPPY_HAVE_TORCH
class Torch {
 public:
  Torch(const LearnerOptions& o, const Replay& replay, const Learner<float>& start)
      : replay_(replay), rows_(o.batch), peer_(o, replay, false, reference::TorchLearner::start(start)) {}
  void update() {
    replay_.sample(0, count_++, 0, rows_);
    peer_.update(rows_, {}, kRate, kRate);
  }

 private:
  const Replay& replay_;
  std::vector<std::uint32_t> rows_;
  reference::TorchLearner peer_;
  std::uint64_t count_ = 0;
};
#endif

}  // namespace

Replay random_replay() {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  Replay replay(kShape, kTransitions);
  std::vector<float> row(52);
  for (std::size_t i = 0; i < kTransitions; ++i) {
    for (float& x : row) x = unit(engine);
    replay.add({row.data(), &row[24], &row[28], unit(engine), 0.99F});
  }
  return replay;
}

LearnerOptions learner_options(std::vector<int> critic, std::size_t batch, bool td3) {
  LearnerOptions o;
  o.shape = kShape;
  o.input = {std::vector<double>(24, 0.0), std::vector<double>(24, 1.0), 10};
  o.critic_hidden = std::move(critic);
  o.batch = batch;
  if (!td3) o.twin = false, o.policy_delay = 1, o.noise_sd = 0;
  return o;
}

std::vector<LearnerRow> measure_learner(const SpeedOptions& options, const std::function<void(int, int)>& progress) {
  const Replay replay = random_replay();
  std::vector<LearnerRow> rows;
  for (const std::size_t batch : {64U, 256U, 1024U, 4096U})
    rows.push_back({"DDPG 64-64, batch " + std::to_string(batch), learner_options({64, 64}, batch, false)});
  rows.push_back({"TD3 128-128, batch 256", learner_options({128, 128}, 256, true)});
  int done = 0;
  for (LearnerRow& row : rows) {
    row.multiply_adds = multiply_adds(row.options);
    LearnerOptions two_threads = row.options;
    two_threads.threads = 2;
    Learner<float> one(row.options), two(two_threads);
#ifdef FLAPPY_HAVE_TORCH
    std::unique_ptr<Torch> torch;
    std::unique_ptr<learn::LearnerEngine> engine;
    if (options.peers) {
      torch = std::make_unique<Torch>(row.options, replay, one);
      engine = learn::make_engine(learn::EngineKind::libtorch, row.options);
    }
#endif
    const auto by_one = [&] { one.update(replay, kRate, kRate); };
    std::vector<double> ours, theirs, ratios, shares, scaling;
    for (int round = 0; round < options.rounds; ++round) {
      ours.push_back(per_second(options.seconds, processor_seconds, by_one));
#ifdef FLAPPY_HAVE_TORCH
      if (torch) {
        theirs.push_back(per_second(options.seconds, processor_seconds, [&] { torch->update(); }));
        ratios.push_back(ours.back() / theirs.back());
        shares.push_back(
            per_second(options.seconds, processor_seconds, [&] { engine->update(replay, kRate, kRate, {}); }) /
            theirs.back());
      }
#endif
      const double alone = per_second(options.seconds, wall_seconds, by_one);
      scaling.push_back(per_second(options.seconds, wall_seconds, [&] { two.update(replay, kRate, kRate); }) / alone);
      progress(++done, options.rounds * static_cast<int>(rows.size()));
    }
    row.updates_per_s = summary(std::move(ours));
    if (!theirs.empty())
      row.torch_per_s = summary(std::move(theirs)), row.times_torch = summary(std::move(ratios)),
      row.engine_share = summary(std::move(shares));
    row.two_thread_scaling = summary(std::move(scaling));
  }
  return rows;
}

}  // namespace flappy::bench
