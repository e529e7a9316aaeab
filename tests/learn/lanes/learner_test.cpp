// The learner's promises that need no reference. Its gradients and updates: autograd_test. Its bits: determinism.
#include "learn/lanes/learner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "learn/lanes/learners.hpp"
#include "policy/actor.hpp"
#include "sim/lanes.hpp"

namespace flappy::learn {
namespace {

template <class T>
std::vector<T> copy(const Learner<T>& learner) {
  const auto all = learner.numbers();
  return {all.begin(), all.end()};
}

using Network = Learner<float>::Network;
using Kind = Learner<float>::Kind;

std::vector<float> numbers(const Learner<float>& learner, Network network, Kind kind) {
  std::vector<float> list;
  for (const auto& layer : learner.layers(network, kind))
    list.insert(list.end(), layer.numbers.begin(), layer.numbers.end());
  return list;
}

TEST(Learner, padded_numbers_stay_zero) {
  const Replay replay = random_replay(kWide, 300);
  Learner<float> learner(td3(kWide));
  for (int i = 0; i < 20; ++i) learner.update(replay, 1e-3, 1e-3);
  std::size_t padding = 0, rest = 0;
  for (const auto network : {Network::critic_1, Network::critic_2, Network::actor})
    for (const auto kind : {Kind::weights, Kind::targets, Kind::first_moments, Kind::second_moments})
      for (const auto& layer : learner.layers(network, kind))
        for (std::size_t i = 0; i < layer.numbers.size(); ++i) {
          const bool pads = static_cast<int>(i) % layer.padded >= layer.outputs;
          if (pads) EXPECT_EQ(layer.numbers[i], 0);
          padding += pads;
          rest += !pads && layer.numbers[i] != 0;
        }
  EXPECT_GT(padding, 1000U);
  EXPECT_GT(rest, 10 * 1000U);
}

TEST(Learner, starts_as_asked) {
  LearnerOptions o = td3(kPlain);
  o.last_layer_scale = 0.1;
  const Learner<double> learner(o);
  for (const auto network :
       {Learner<double>::Network::critic_1, Learner<double>::Network::critic_2, Learner<double>::Network::actor}) {
    const auto layers = learner.layers(network);
    for (const auto& layer : layers) {
      const double bound = (&layer == &layers.back() ? 0.1 : 1) / std::sqrt(layer.inputs);
      double largest = 0, square = 0;
      for (int i = 0; i <= layer.inputs; ++i)
        for (int k = 0; k < layer.outputs; ++k) {
          const double w = layer.numbers[static_cast<std::size_t>(i * layer.padded + k)];
          if (i == 0) EXPECT_EQ(w, 0);
          largest = std::max(largest, std::abs(w));
          square += w * w;
        }
      EXPECT_LT(largest, bound);
      EXPECT_GT(largest, 0.9 * bound);
      // the mean square of a uniform distribution is a third of the bound's; at 37 weights its sd is 15 %
      EXPECT_NEAR(square / (layer.inputs * layer.outputs), bound * bound / 3, 0.5 * bound * bound / 3);
    }
  }
  EXPECT_NE(learner.layers(Learner<double>::Network::critic_1)[0].numbers[100],
            learner.layers(Learner<double>::Network::critic_2)[0].numbers[100]);
  const auto all = learner.numbers();
  EXPECT_TRUE(std::equal(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 4),
                         all.begin() + static_cast<std::ptrdiff_t>(all.size() / 4)))
      << "targets start elsewhere";
  o.seed += 1;
  EXPECT_NE(copy(Learner<double>(o)), copy(learner));
}

/// What comes after a termination is not looked at, be it no number at all.
TEST(Learner, termination_hides_what_comes_next) {
  const Replay replay = random_replay(kWide, 300);
  Replay broken = random_replay(kWide, 300), live = random_replay(kWide, 300);
  const TransitionLayout& at = replay.layout();
  const auto spoil = [&](Replay& r, bool terminated) {
    std::vector<float> rows(r.rows().begin(), r.rows().end());
    for (std::size_t i = 0; i < r.size(); ++i)
      if ((rows[i * at.row + at.discount] == 0) == terminated)
        for (std::size_t k = at.next_observation; k < at.row; ++k)
          rows[i * at.row + k] = terminated ? std::numeric_limits<float>::quiet_NaN() : -rows[i * at.row + k];
    r.restore(rows, 0);
  };
  spoil(broken, true);
  spoil(live, false);
  Learner<float> a(td3(kWide)), b(td3(kWide)), c(td3(kWide));
  for (int i = 0; i < 3; ++i) {
    a.update(replay, 1e-3, 1e-3);
    b.update(broken, 1e-3, 1e-3);
    c.update(live, 1e-3, 1e-3);
  }
  EXPECT_EQ(copy(a), copy(b));
  EXPECT_NE(copy(a), copy(c));
}

TEST(Learner, actor_and_targets_move_every_policy_delay_th_update) {
  const Replay replay = random_replay(kPlain, 300);
  LearnerOptions o = td3(kPlain);
  o.policy_delay = 3;
  Learner<float> learner(o);
  const auto look = [&](Network n, Kind k) { return numbers(learner, n, k); };
  for (int update = 1; update <= 7; ++update) {
    const auto actor = look(Network::actor, Kind::weights), critic = look(Network::critic_1, Kind::weights);
    const auto moments = look(Network::actor, Kind::second_moments);
    const auto actor_target = look(Network::actor, Kind::targets), target = look(Network::critic_2, Kind::targets);
    learner.update(replay, 1e-3, 1e-3);
    const bool turn = update % 3 == 0;
    EXPECT_NE(look(Network::critic_1, Kind::weights), critic);
    EXPECT_EQ(look(Network::actor, Kind::weights) != actor, turn) << update;
    EXPECT_EQ(look(Network::actor, Kind::second_moments) != moments, turn);
    EXPECT_EQ(look(Network::actor, Kind::targets) != actor_target, turn);
    EXPECT_EQ(look(Network::critic_2, Kind::targets) != target, turn);
  }
  EXPECT_EQ(learner.counters().updates, 7U);
  EXPECT_EQ(learner.counters().actor_beta1, 0.9 * 0.9);
}

TEST(Learner, acts_as_flight_evaluates_its_actor) {
  for (const LearnerOptions& o : {td3(kPlain), ddpg(kPlain)}) {
    Learner<float> learner(o);
    const Replay replay = random_replay(kPlain, 300);
    for (int i = 0; i < 5; ++i) learner.update(replay, 1e-2, 1e-3);
    const policy::Actor actor = learner.actor();
    std::vector<float> all;
    for (const auto* list : {&actor.weights, &actor.mean, &actor.scale})
      for (const double x : *list) all.push_back(static_cast<float>(x));
    policy::ActorView<float> view;
    view.layers = static_cast<int>(actor.widths.size()) - 1;
    std::ranges::copy(actor.widths, view.widths);
    view.hidden = actor.hidden;
    view.weights = all.data();
    view.mean = view.weights + actor.weights.size();
    view.scale = view.mean + actor.mean.size();
    view.clip = static_cast<float>(actor.clip);

    constexpr std::size_t kCount = 100;  // more than a chunk
    std::vector<float> seen, actions(kCount * 4);
    for (std::size_t i = 0; i < kCount; ++i) seen.insert(seen.end(), replay.row(i), replay.row(i) + 17);
    learner.act(seen.data(), kCount, actions.data());
    using One = model::Lanes<float, 1>;
    for (std::size_t i = 0; i < kCount; ++i) {
      One in[17], out[4];
      for (std::size_t k = 0; k < 17; ++k) in[k] = One::load(&seen[i * 17 + k]);
      policy::evaluate(view, in, out);
      for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(actions[i * 4 + k], out[k].raw[0]) << i << ", " << k;
    }
  }
}

TEST(Learner, an_actor_goes_in_and_comes_out) {
  const Replay replay = random_replay(kPlain, 300);
  Learner<float> from(td3(kPlain));
  for (int i = 0; i < 4; ++i) from.update(replay, 1e-2, 1e-3);
  const auto targets_are_weights = [](Learner<float>& l) {
    const std::size_t count = l.numbers().size() / 4;  // weights, targets, two moments
    return std::ranges::equal(l.numbers().first(count), l.numbers().subspan(count, count));
  };
  EXPECT_FALSE(targets_are_weights(from));
  LearnerOptions o = td3(kPlain);
  o.seed = 77;
  Learner<float> to(o);
  EXPECT_NE(to.actor().weights, from.actor().weights);
  to.set_actor(from.actor());
  EXPECT_EQ(to.actor().weights, from.actor().weights);
  EXPECT_TRUE(targets_are_weights(to));
  EXPECT_EQ(to.actor().mean, o.input.mean);
  policy::Actor other = from.actor();
  other.hidden = policy::Activation::relu;
  EXPECT_THROW(to.set_actor(other), std::invalid_argument);
  other = from.actor();
  other.linear = true;
  EXPECT_THROW(to.set_actor(other), std::invalid_argument);
  other = Learner<float>(ddpg(kPlain)).actor();
  EXPECT_THROW(to.set_actor(other), std::invalid_argument);
}

TEST(Learner, shows_that_something_is_broken) {
  Replay replay = random_replay(kPlain, 300);
  std::vector<float> rows(replay.rows().begin(), replay.rows().end());
  Learner<float> learner(td3(kPlain));
  learner.update(replay, 1e-3, 1e-3);
  EXPECT_TRUE(std::isfinite(learner.metrics().critic_loss));
  for (std::size_t i = 0; i < replay.size(); ++i)
    rows[i * replay.layout().row + replay.layout().reward] = std::numeric_limits<float>::infinity();
  replay.restore(rows, 0);
  learner.update(replay, 1e-3, 1e-3);
  EXPECT_FALSE(std::isfinite(learner.metrics().critic_loss));
}

TEST(Learner, learns_a_reward_of_the_action) {
  // r = 1 - |a - 0.5|^2 at every observation, every episode over at once: Q is r, and the best action is 0.5
  std::mt19937 engine(5);
  Replay replay({3, 2}, 4096);
  for (int i = 0; i < 4096; ++i) {
    std::vector<float> x(5);
    for (float& v : x) v = static_cast<float>(static_cast<int>(engine() >> 8) - (1 << 23)) * 0x1p-23F;
    const float reward = 1 - (x[3] - 0.5F) * (x[3] - 0.5F) - (x[4] - 0.5F) * (x[4] - 0.5F);
    replay.add({x.data(), x.data() + 3, x.data(), reward, 0});
  }
  for (const double huber : {0.0, 1.0}) {
    LearnerOptions o;
    o.shape = {3, 2};
    o.input = {{0, 0, 0}, {1, 1, 1}, 10};
    o.batch = 128;
    o.huber = huber;
    Learner<float> learner(o);
    for (int i = 0; i < 1500; ++i) learner.update(replay, 1e-3, 3e-3);
    EXPECT_LT(learner.metrics().critic_loss, 0.01);
    EXPECT_NEAR(learner.metrics().actor_q, 1, 0.05);
    std::vector<float> actions(2 * 64);
    learner.act(replay.row(0), 64, actions.data());
    for (const float a : actions) EXPECT_NEAR(a, 0.5, 0.15);
  }
}

TEST(Learner, refuses_what_makes_no_learner) {
  const auto refused = [](auto change) {
    LearnerOptions o = td3(kPlain);
    change(o);
    EXPECT_THROW(Learner<float>{o}, std::invalid_argument);
  };
  refused([](LearnerOptions& o) { o.batch = 100; });
  refused([](LearnerOptions& o) { o.batch = 0; });
  refused([](LearnerOptions& o) { o.threads = 0; });
  refused([](LearnerOptions& o) { o.policy_delay = 0; });
  refused([](LearnerOptions& o) { o.actor_hidden = {policy::kMaxWidth + 1}; });
  refused([](LearnerOptions& o) { o.critic_hidden = std::vector<int>(policy::kMaxLayers, 8); });
  refused([](LearnerOptions& o) { o.layer_norm = true; });
  refused([](LearnerOptions& o) { o.critic_activation = policy::Activation::silu; });
  refused([](LearnerOptions& o) { o.input.mean.pop_back(); });
  refused([](LearnerOptions& o) { o.shape.observation = 5; });
  refused([](LearnerOptions& o) { o.instruction_set = "mips"; });
  Learner<float> learner(td3(kPlain));
  EXPECT_THROW(learner.update(random_replay(kWide, 10), 1, 1), std::invalid_argument);
  EXPECT_THROW(learner.update(Replay(kPlain, 10), 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace flappy::learn
