// What is trained and how, as configs/train/*.toml state it:
//
//   schema = 1
//   fly = "file"            what is flown: vehicles, task, sensors, controller; relative to the folder of the configuration
//   seed                    of weights, samples, noise and the vehicles trained on; evaluation flies with the seed of `fly`
//   threads                 0: all
//   [observation]           optional: part = [scale of each of its signals], in place of 2 / (high - low) of their ranges
//   [networks]              actor, critic: widths of hidden layers; activation = "relu" | "tanh" | "elu" | "silu";
//                           layer_norm (before it; unless told: false). The last two, layer_norm, and weight_decay, gradient_clip
//                           (largest norm of a gradient; 0: none) and device = "cpu" | "cuda" in [learn] need libtorch
//   [collect]               flappers, vehicles (settled, from which episodes are sampled), noise_low, noise_high, noise_kept (from
//                           action to action), steps_before (actions of each flapper before the first update)
//   [reward]                scale, discount (from action to action), steps (of the return that the critics learn)
//   [learn]                 engine = "lanes" (unless told) | "libtorch", updates, updates_per_step, batch, actor_rate, critic_rate,
//                           schedule = "line" (unless told) | "cosine" (of the rates, down to last_rate, their share at the last
//                           update), warm_up (updates until the rates are whole; unless told: 0), actor_after (updates in which the critics learn
//                           alone, for an actor that knows already how to fly; unless told: 0), averaging (tau), twin,
//                           policy_delay, target_noise, target_noise_clip, huber (0: squares), replay (transitions kept), policy_averaging (share of
//                           the actor that the policy takes over after each step; 1: the policy is the actor)
//   [evaluate]              every (updates), vehicles
//   [checkpoint]            every (updates), keep
//
// Updates are counted in whole steps: every figure above is rounded up to a multiple of updates_per_step.
//
// Any other override, as "task.reward.goal=1", belongs to `fly`.
#pragma once

#include "learn/engine.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::learn {

struct TrainConfig {
  rollout::FlyConfig fly;
  std::uint64_t seed = 0;
  int threads = 0;  ///< at least 1
  EngineKind engine = EngineKind::lanes;
  LearnerOptions learner;

  std::size_t flappers = 0, vehicles = 0, steps_before = 0;
  flight::Exploration exploration;
  double reward_scale = 1, discount = 1;
  std::size_t return_steps = 1;
  std::uint64_t updates = 0, updates_per_step = 1;
  double actor_rate = 0, critic_rate = 0, last_rate = 1, policy_averaging = 1;
  bool cosine = false;
  std::uint64_t warm_up = 0, actor_after = 0;
  std::size_t replay = 0;
  std::uint64_t evaluate_every = 0, checkpoint_every = 0;
  std::size_t evaluate_vehicles = 0, keep = 2;

  /// Texts of the files that were read, by name, as FlyConfig::resolved; train.toml names fly.toml, which names the
  /// policy of the run as its actor.
  std::map<std::string, std::string> resolved;
  std::string sha256;  ///< of all of them but for the number of threads

  /// Share of the rates of learning at an update.
  double rate_share(std::uint64_t update) const;
  /// An actor of this task, without weights.
  policy::Actor blank_actor() const;
};

/// io::InputError for whatever is missing, unknown, out of range or does not fit together.
TrainConfig read_train_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::learn
