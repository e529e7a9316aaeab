// Gradients and whole updates against LibTorch's automatic differentiation and Adam, in double.
#include <gtest/gtest.h>

#include <cmath>

#include "learners.hpp"
#include "sim/lanes.hpp"
#include "sim/noise.hpp"
#include "sim/random.hpp"
#include "torch_peer.hpp"

namespace flappy::learn {
namespace {

using oracle::TorchLearner;

struct Case {
  const char* name;
  LearnerOptions options;
};

std::vector<Case> cases() {
  LearnerOptions huber = td3(kPlain), many = ddpg(kPlain);
  huber.huber = 0.3;
  huber.actor_activation = flight::Activation::relu;
  many.batch = 18 * kChunk;  // two chunks share a part of the gradients
  return {{"td3", td3(kPlain)}, {"td3 with privileged critics", td3(kPrivileged)}, {"huber", huber}, {"ddpg", many}};
}

/// For each layer, for every output its bias, then one number for each input.
template <class T>
TorchLearner::Numbers numbers(const Learner<T>& learner, int network, typename Learner<T>::Kind kind) {
  TorchLearner::Numbers list;
  for (const auto& layer : learner.layers(static_cast<typename Learner<T>::Network>(network), kind))
    for (int o = 0; o < layer.outputs; ++o)
      for (int i = 0; i <= layer.inputs; ++i)
        list.push_back(layer.numbers[static_cast<std::size_t>(i * layer.padded + o)]);
  return list;
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
  std::unique_ptr<TorchLearner> theirs;
  std::uint64_t updates = 0;

  explicit Pair(const LearnerOptions& o) : replay(random_replay(o.shape, 700)), ours(o) {
    const bool twin = o.twin;
    const TorchLearner::Numbers start[3] = {
        numbers(ours, 0, Learner<T>::Kind::weights),
        twin ? numbers(ours, 1, Learner<T>::Kind::weights) : TorchLearner::Numbers(),
        numbers(ours, 2, Learner<T>::Kind::weights)};
    theirs = std::make_unique<TorchLearner>(o, replay, true, start);
  }
  void update(double actor_rate, double critic_rate) {
    const LearnerOptions& o = ours.options();
    std::vector<std::uint32_t> rows(o.batch);
    replay.draw(o.seed, updates, 0, rows);
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
    theirs->update(rows, noise, actor_rate, critic_rate);
    ++updates;
  }
  void expect_near(const char* name, double tolerance) const {
    for (int n = ours.options().twin ? 0 : 0; n < 3; ++n) {
      if (n == 1 && !ours.options().twin) continue;
      const auto network = static_cast<TorchLearner::Network>(n);
      EXPECT_LT(difference(numbers(ours, n, Learner<T>::Kind::weights), theirs->weights(network)), tolerance)
          << name << ", weights of network " << n << " after " << updates;
      EXPECT_LT(difference(numbers(ours, n, Learner<T>::Kind::targets), theirs->targets(network)), tolerance)
          << name << ", targets of network " << n << " after " << updates;
    }
    EXPECT_LT(std::abs(ours.metrics().critic_loss / theirs->critic_loss() - 1), tolerance) << name;
  }
};

/// After one update the first moments are (1 - beta1) times the gradients. A gradient is a mean over the batch of products
/// along at most 12 chains of up to 64 terms, whose roundings do not conspire: some ten ulp of its norm. Measured: LOW in
/// float, HIGH in double.
template <class T>
void gradients_agree(double tolerance) {
  for (const auto& [name, options] : cases()) {
    LearnerOptions o = options;
    o.policy_delay = 1;
    Pair<T> pair(o);
    pair.update(1e-3, 1e-3);
    for (int n = 0; n < 3; ++n) {
      if (n == 1 && !o.twin) continue;
      const auto theirs = pair.theirs->gradients(static_cast<TorchLearner::Network>(n));
      const double gap = difference(numbers(pair.ours, n, Learner<T>::Kind::first_moments), theirs, 1 - o.beta1);
      EXPECT_LT(gap, tolerance) << name << ", network " << n;
    }
  }
}

TEST(Autograd, gradients_in_float) { gradients_agree<float>(1e-6); }
TEST(Autograd, gradients_in_double) { gradients_agree<double>(2e-15); }

/// Adam divides by the size of the gradient, so a gradient that cancels to 1e-3 of its terms hands its rounding on a thousand
/// times larger.
TEST(Autograd, twenty_updates_in_double) {
  for (const auto& [name, options] : cases()) {
    Pair<double> pair(options);
    for (int i = 0; i < 20; ++i) pair.update(1e-3 / (1 + i), 2e-3);
    pair.expect_near(name, 1e-12);
  }
}

TEST(Autograd, twenty_updates_in_float) {
  for (const auto& [name, options] : cases()) {
    Pair<float> pair(options);
    for (int i = 0; i < 20; ++i) pair.update(1e-3 / (1 + i), 2e-3);
    pair.expect_near(name, 1e-4);
  }
}

}  // namespace
}  // namespace flappy::learn
