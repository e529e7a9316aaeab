// Gradients and whole updates against LibTorch's automatic differentiation and Adam, in double.
#include <gtest/gtest.h>

#include <cmath>

#include "learn/lanes/learners.hpp"
#include "sim/lanes.hpp"
#include "sim/noise.hpp"
#include "sim/random.hpp"
#include "torch_peer.hpp"

namespace flappy::learn {
namespace {

using reference::TorchLearner;

struct Case {
  const char* name;
  LearnerOptions options;
};

std::vector<Case> cases() {
  LearnerOptions huber = td3(kPlain), many = ddpg(kPlain);
  huber.huber = 0.3;
  huber.actor_activation = policy::Activation::relu;
  many.batch = 18 * kChunk;  // two chunks share a part of the gradients
  return {{"td3", td3(kPlain)}, {"td3 of another shape", td3(kWide)}, {"huber", huber}, {"ddpg", many}};
}

using Network = TorchLearner::Network;

std::vector<Network> networks(const LearnerOptions& o) {
  if (o.twin) return {Network::critic_1, Network::critic_2, Network::actor};
  return {Network::critic_1, Network::actor};
}

/// |a - scale b| / |scale b|, Euclidean norms.
double difference(const TorchLearner::Numbers& a, const TorchLearner::Numbers& b, double scale = 1) {
  EXPECT_EQ(a.size(), b.size());
  double gap = 0, norm = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    gap += (a[i] - scale * b[i]) * (a[i] - scale * b[i]);
    norm += scale * b[i] * scale * b[i];
  }
  EXPECT_GT(norm, 0);
  return std::sqrt(gap / norm);
}

/// The learner, and LibTorch beside it with the same transitions and noise.
template <class T>
struct Pair {
  Replay replay;
  Learner<T> ours;
  TorchLearner theirs;
  std::uint64_t updates = 0;

  explicit Pair(const LearnerOptions& o)
      : replay(random_replay(o.shape, 700)), ours(o), theirs(o, replay, true, TorchLearner::start(ours)) {}
  void update(double actor_rate, double critic_rate) {
    const LearnerOptions& o = ours.options();
    std::vector<std::uint32_t> rows(o.batch);
    replay.sample(o.seed, updates, 0, rows);
    std::vector<double> noise;
    using One = model::Lanes<double, 1>;
    for (std::uint32_t s = 0; s < o.batch && o.noise_sd > 0; ++s)
      for (std::uint32_t a = 0; a < static_cast<std::uint32_t>(o.shape.action); ++a) {
        const auto update = static_cast<std::uint32_t>(updates);
        const auto n =
            sim::normals<One>(o.seed, static_cast<std::uint32_t>(sim::Stream::target_noise), a / 4, &s, &update);
        noise.push_back(n.n[a % 4].raw[0]);
      }
    ours.update(replay, actor_rate, critic_rate);
    theirs.update(rows, noise, actor_rate, critic_rate);
    ++updates;
  }
  void expect_near(const char* name, double tolerance) const {
    using Kind = typename Learner<T>::Kind;
    for (const Network n : networks(ours.options())) {
      EXPECT_LT(difference(TorchLearner::numbers(ours, n, Kind::weights), theirs.weights(n)), tolerance)
          << name << ", weights of network " << static_cast<int>(n) << " after " << updates;
      EXPECT_LT(difference(TorchLearner::numbers(ours, n, Kind::targets), theirs.targets(n)), tolerance)
          << name << ", targets of network " << static_cast<int>(n) << " after " << updates;
    }
    EXPECT_LT(std::abs(ours.metrics().critic_loss / theirs.critic_loss() - 1), tolerance) << name;
  }
};

/// After one update the first moments are (1 - beta1) times the gradients. A gradient is a mean over the batch of products
/// along some 6 chains of up to 64 terms, whose roundings do not conspire: some ten ulp of its norm. Measured: up to 3.9e-7
/// in float (3 ulp), 1.2e-15 in double, where LibTorch rounds too.
template <class T>
void gradients_agree(double tolerance) {
  for (const auto& [name, options] : cases()) {
    LearnerOptions o = options;
    o.policy_delay = 1;
    Pair<T> pair(o);
    pair.update(1e-3, 1e-3);
    for (const Network n : networks(o)) {
      const auto moments = TorchLearner::numbers(pair.ours, n, Learner<T>::Kind::first_moments);
      EXPECT_LT(difference(moments, pair.theirs.gradients(n), 1 - o.beta1), tolerance)
          << name << ", network " << static_cast<int>(n);
    }
  }
}

TEST(Autograd, gradients_in_float) { gradients_agree<float>(1e-6); }
TEST(Autograd, gradients_in_double) { gradients_agree<double>(3e-15); }

/// Adam divides by the size of the gradient, so one that cancels to 1e-3 of its terms hands on a thousand times its rounding, to
/// a step of 1e-2 of the weights. Measured: up to 2.5e-6 in float, 1.3e-15 in double.
TEST(Autograd, twenty_updates_in_double) {
  for (const auto& [name, options] : cases()) {
    Pair<double> pair(options);
    for (int i = 0; i < 20; ++i) pair.update(1e-3 / (1 + i), 2e-3);
    pair.expect_near(name, 1e-13);
  }
}

TEST(Autograd, twenty_updates_in_float) {
  for (const auto& [name, options] : cases()) {
    Pair<float> pair(options);
    for (int i = 0; i < 20; ++i) pair.update(1e-3 / (1 + i), 2e-3);
    pair.expect_near(name, 2e-5);
  }
}

}  // namespace
}  // namespace flappy::learn
