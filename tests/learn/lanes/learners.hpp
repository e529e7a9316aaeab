// What learns in the tests: random transitions, and options whose widths fill no tile or register exactly.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "learn/lanes/learner.hpp"

namespace flappy::learn {

/// Every tenth transition terminates.
inline Replay random_replay(const TransitionShape& shape, std::size_t count, std::uint32_t seed = 1) {
  std::mt19937 engine(seed);
  const auto unit = [&] { return static_cast<float>(static_cast<int>(engine() >> 8) - (1 << 23)) * 0x1p-23F; };
  const auto row = [&](int n) {
    std::vector<float> list;
    for (int i = 0; i < n; ++i) list.push_back(unit());
    return list;
  };
  Replay replay(shape, count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto seen = row(shape.observation), next = row(shape.observation), action = row(shape.action);
    replay.add({seen.data(), action.data(), next.data(), unit(), i % 10 == 3 ? 0.0F : 0.97F});
  }
  return replay;
}

/// Numbers of mean -0.5 to 0.5 and scale 1 to 2.5, of which the clip cuts some.
inline Normaliser normaliser(int inputs) {
  Normaliser n;
  for (int i = 0; i < inputs; ++i) {
    n.mean.push_back(0.5 - (i * 7 % 8) / 7.0);
    n.scale.push_back(1 + (i * 5 % 7) / 4.0);
  }
  n.clip = 1.5;
  return n;
}

inline LearnerOptions td3(const TransitionShape& shape) {
  LearnerOptions o;
  o.shape = shape;
  o.actor_hidden = {19, 33};
  o.critic_hidden = {45, 37};
  o.actor_activation = policy::Activation::tanh;
  o.input = normaliser(shape.observation);
  o.batch = 192;
  o.last_layer_scale = 1;
  o.tau = 0.05;
  o.seed = 0x123456789abcULL;
  return o;
}

inline LearnerOptions ddpg(const TransitionShape& shape) {
  LearnerOptions o = td3(shape);
  o.actor_activation = policy::Activation::relu;
  o.critic_activation = policy::Activation::tanh;
  o.actor_hidden = {32, 32};
  o.critic_hidden = {64, 64};
  o.twin = false;
  o.policy_delay = 1;
  o.noise_sd = 0;
  o.batch = 128;
  return o;
}

inline constexpr TransitionShape kPlain{17, 4}, kWide{35, 5};

}  // namespace flappy::learn
