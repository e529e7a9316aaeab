// The two engines: one algorithm, one checkpoint's worth of numbers.
#include "learn/engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "learn/lanes/learners.hpp"
#include "learn/torch/torch_learner.hpp"

namespace flappy::learn {
namespace {

constexpr double kActorRate = 1e-3, kCriticRate = 2e-3;

double largest(const std::vector<float>& numbers) {
  return std::abs(*std::ranges::max_element(numbers, {}, [](float x) { return std::abs(x); }));
}

/// Every number of the actor, and what is measured, after each of `updates`.
void expect_equal_updates(const LearnerOptions& options, int updates) {
  const Replay replay = random_replay(options.shape, 1000);
  const auto lanes = make_engine(EngineKind::lanes, options), torch = make_engine(EngineKind::libtorch, options);
  EXPECT_EQ(lanes->actor().weights, torch->actor().weights) << "they begin as one";
  for (int u = 1; u <= updates; ++u) {
    lanes->update(replay, kActorRate, kCriticRate, {});
    torch->update(replay, kActorRate, kCriticRate, {});
    const auto a = lanes->actor().weights, b = torch->actor().weights;
    // Adam divides a moment by its root: of a gradient that is near its rounding, a step keeps no more than some digits
    std::size_t off = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      off += std::abs(a[i] - b[i]) > 1e-6;
      ASSERT_NEAR(a[i], b[i], 0.02 * kActorRate) << "update " << u << ", number " << i;
    }
    EXPECT_LE(off, a.size() / 200) << "update " << u << " of " << a.size() << " numbers";
    EXPECT_NEAR(lanes->metrics().critic_loss, torch->metrics().critic_loss, 1e-6 * lanes->metrics().critic_loss + 1e-6);
    EXPECT_NEAR(lanes->metrics().mean_q, torch->metrics().mean_q, 2e-6);
    EXPECT_NEAR(lanes->metrics().actor_q, torch->metrics().actor_q, 2e-6);
  }
  EXPECT_EQ(lanes->counters().updates, torch->counters().updates);
}

TEST(Engines, DoOneAlgorithm) {
  expect_equal_updates(td3(kPlain), 4);
  expect_equal_updates(td3(kWide), 4);
  expect_equal_updates(ddpg(kPlain), 4);
  LearnerOptions huber = td3(kPlain);
  huber.huber = 0.3;
  expect_equal_updates(huber, 2);
}

/// In double, the plugin's update is that of the lanes.
TEST(Engines, AgreeInDoubleToRounding) {
  LearnerOptions o = td3(kWide);
  o.noise_sd = 0;  // which is drawn in float for the one, in double for the other
  o.policy_delay = 1;
  const Replay replay = random_replay(o.shape, 1000);
  Learner<double> lanes(o);
  const auto torch = torch_functions().make(o, true);
  using Of = Learner<double>::Network;
  std::vector<double> weights, wanted;
  const auto gather = [&](std::vector<double>& to) {
    to.clear();
    for (const Of network : {Of::critic_1, Of::critic_2, Of::actor})
      for (const auto& layer : lanes.layers(network))
        for (int out = 0; out < layer.outputs; ++out)
          for (int i = 0; i <= layer.inputs; ++i)
            to.push_back(layer.numbers[static_cast<std::size_t>(i * layer.padded + out)]);
  };
  gather(weights);
  torch->set(TorchLearner::Kind::weights, weights);
  torch->set(TorchLearner::Kind::targets, weights);
  for (std::uint64_t u = 0; u < 3; ++u) {
    std::vector<std::uint32_t> rows(o.batch);
    replay.sample(o.seed, u, 0, rows);
    lanes.update(replay, kActorRate, kCriticRate);
    const LearnerCounters& n = lanes.counters();
    const TorchLearner::Batch batch{rows,
                                    {},
                                    true,
                                    {kActorRate, 1 / (1 - n.actor_beta1), 1 / std::sqrt(1 - n.actor_beta2)},
                                    {kCriticRate, 1 / (1 - n.critic_beta1), 1 / std::sqrt(1 - n.critic_beta2)}};
    torch->differentiate(replay, batch, 1);
    torch->step(batch);
    gather(wanted);
    torch->get(TorchLearner::Kind::weights, weights);
    double most = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) most = std::max(most, std::abs(weights[i] - wanted[i]));
    EXPECT_LT(most, 1e-12) << "update " << u;
  }
}

/// What is trained is what flies: networks that LibTorch alone trains act as the lanes have them.
TEST(Engines, TrainWhatTheLanesFly) {
  for (const policy::Activation hidden :
       {policy::Activation::elu, policy::Activation::silu, policy::Activation::relu}) {
    LearnerOptions o = td3(kPlain);
    o.actor_hidden = {24, 70, 10};
    o.actor_activation = o.critic_activation = hidden;
    o.layer_norm = hidden != policy::Activation::elu;
    o.weight_decay = 1e-2, o.gradient_clip = 0.5;
    EXPECT_THROW(make_engine(EngineKind::lanes, o), std::invalid_argument);
    const auto engine = make_engine(EngineKind::libtorch, o);
    const Replay replay = random_replay(o.shape, 500);
    for (int u = 0; u < 50; ++u) engine->update(replay, 10 * kActorRate, kCriticRate, {});
    const policy::Actor a = engine->actor();
    EXPECT_EQ(a.weights.size(), policy::weight_count(a.widths, o.layer_norm));
    std::vector<double> seen(17), flown(4);
    std::vector<float> row(17), acted(4);
    for (std::size_t k = 0; k < 20; ++k) {
      std::copy_n(replay.row(k), 17, row.begin());
      std::ranges::copy(row, seen.begin());
      engine->act(row.data(), 1, acted.data());
      policy::evaluate(policy::view_of(a, a.weights.data(), a.mean.data(), a.scale.data()), seen.data(), flown.data());
      // a few hundred roundings of float, each amplified by what layer norm divides by
      for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(acted[i], flown[i], 2e-5) << name_of(hidden);
    }
  }
}

/// AdamW's decay takes its share of a weight that has no gradient, and a limited gradient is shorter, not another.
TEST(Engines, DecayWeightsAndLimitGradients) {
  LearnerOptions plain = td3(kPlain);
  plain.policy_delay = 100;  // critics alone learn
  LearnerOptions limited = plain, decayed = plain;
  limited.gradient_clip = 1e-3;
  decayed.weight_decay = 0.1;
  const Replay replay = random_replay(plain.shape, 500);
  const auto after = [&](const LearnerOptions& o) {
    const auto engine = make_engine(EngineKind::libtorch, o);
    const std::vector<float> before = engine->save();
    engine->update(replay, kActorRate, kCriticRate, {});
    return std::pair{before, engine->save()};
  };
  const auto [before, whole] = after(plain);
  const auto cut = after(limited).second, less = after(decayed).second;
  const std::size_t count = before.size() / 4, actor = policy::weight_count({17, 19, 33, 4});
  double squares = 0;  // of the first moments of critics: 0.1 of the gradient
  for (std::size_t i = 2 * count; i < 3 * count - actor; ++i) {
    squares += static_cast<double>(cut[i]) * static_cast<double>(cut[i]);
    EXPECT_LE(std::abs(cut[i]), std::abs(whole[i]) + 1e-12F);
  }
  EXPECT_NEAR(std::sqrt(squares), 0.1 * 1e-3, 1e-7);
  for (std::size_t i = 0; i < count - actor; ++i)
    EXPECT_NEAR(less[i], whole[i] - kCriticRate * 0.1 * static_cast<double>(before[i]), 1e-7);
}

TEST(Engines, ActAsTheirActors) {
  const LearnerOptions o = td3(kPlain);
  const Replay replay = random_replay(o.shape, 100);
  const auto lanes = make_engine(EngineKind::lanes, o), torch = make_engine(EngineKind::libtorch, o);
  std::vector<float> seen, a(100 * 4), b(100 * 4);
  for (std::size_t i = 0; i < 100; ++i) seen.insert(seen.end(), replay.row(i), replay.row(i) + o.shape.observation);
  lanes->act(seen.data(), 100, a.data());
  torch->act(seen.data(), 100, b.data());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 2e-6);
  EXPECT_GT(largest(a), 0.1);
}

TEST(Engines, GoOnFromWhatTheySaved) {
  const LearnerOptions o = td3(kPlain);
  const Replay replay = random_replay(o.shape, 500);
  for (const EngineKind kind : {EngineKind::lanes, EngineKind::libtorch}) {
    const auto whole = make_engine(kind, o), half = make_engine(kind, o), rest = make_engine(kind, o);
    for (int u = 0; u < 6; ++u) whole->update(replay, kActorRate, kCriticRate, {});
    for (int u = 0; u < 3; ++u) half->update(replay, kActorRate, kCriticRate, {});
    rest->load(half->save());
    rest->counters() = half->counters();
    for (int u = 0; u < 3; ++u) rest->update(replay, kActorRate, kCriticRate, {});
    EXPECT_EQ(whole->save(), rest->save());
    EXPECT_NE(whole->save(), half->save());
    EXPECT_THROW(rest->load(std::vector<float>(7)), std::invalid_argument);
    std::vector<float> broken = whole->save();
    broken[5] = std::nanf("");
    EXPECT_THROW(rest->load(broken), std::invalid_argument);
  }
}

TEST(Engines, GiveTheSameBytesForAnyNumberOfThreads) {
  LearnerOptions o = td3(kPlain);
  const Replay replay = random_replay(o.shape, 500);
  for (const EngineKind kind : {EngineKind::lanes, EngineKind::libtorch}) {
    o.threads = 1;
    const auto one = make_engine(kind, o);
    o.threads = 3;
    const auto three = make_engine(kind, o);
    std::vector<int> ran(50);
    for (int u = 0; u < 5; ++u) {
      one->update(replay, kActorRate, kCriticRate, {});
      three->update(replay, kActorRate, kCriticRate, {ran.size(), [&](std::size_t i) { ++ran[i]; }});
    }
    EXPECT_EQ(one->save(), three->save());
    EXPECT_EQ(ran, std::vector<int>(50, 5));
  }
}

TEST(Engines, TakeAnActor) {
  const LearnerOptions o = td3(kPlain);
  for (const EngineKind kind : {EngineKind::lanes, EngineKind::libtorch}) {
    const auto engine = make_engine(kind, o);
    policy::Actor other = engine->actor();
    for (double& w : other.weights) w = static_cast<float>(0.5 * w);
    engine->set_actor(other);
    EXPECT_EQ(engine->actor().weights, other.weights);
    other.weights.pop_back();
    EXPECT_THROW(engine->set_actor(other), std::invalid_argument);
  }
}

}  // namespace
}  // namespace flappy::learn
