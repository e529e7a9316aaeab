// Configuration of a training run, as in configs/train/*.toml:
//
//   schema = 1
//   fly = "file"            configuration of the flights: vehicles, task, sensors, controller; relative to this file
//   seed                    seed of weights, samples, noise and training vehicles; evaluation uses the seed of `fly`
//   threads                 0: all
//   [observation]           optional: part = [scale of each of its signals], instead of 2 / (high - low) of their range
//   [networks]              actor, critic: widths of hidden layers; activation = "relu" | "tanh" | "elu" | "silu";
//                           layer_norm (before the activation; default false). Only in libtorch: elu, silu, layer_norm,
//                           [learn] weight_decay, gradient_clip (largest norm; 0: none), device = "cpu" | "cuda"
//   [collect]               flappers, vehicles (settled ones from which episodes start), noise_low, noise_high,
//                           noise_kept (correlation from action to action), steps_before (actions of each flapper
//                           before the first update)
//   [reward]                scale, discount (per action), steps (n of the critics' n-step return)
//   [learn]                 engine = "lanes" (default) | "libtorch", updates, updates_per_step, batch, actor_rate,
//                           critic_rate, schedule = "line" (default) | "cosine": rates fall to their share last_rate;
//                           warm_up (updates in which rates rise; default 0), actor_after (updates in which only the
//                           critics learn, for an actor that can fly; default 0), averaging (tau), twin, policy_delay,
//                           target_noise, target_noise_clip, huber (0: squares), replay (transitions kept),
//                           policy_averaging (weight of the actor in its moving average, the policy; 1: no averaging)
//   [evaluate]              every (updates), vehicles
//   [checkpoint]            every (updates), keep
//   [student]               optional: the run distils teachers into one policy (learn/student.hpp). teacher_updates (of
//                           TD3, for each), memory (units of a GRU before the hidden layers; 0: none), hidden (widths of
//                           its layers), rounds, flights (in a round, each of another robot), redraw (rounds until new
//                           robots fly), led (rounds before the last flight led by a teacher), kept (rounds of flights
//                           that are learnt from), steps (of Adam after each round), batch (flights in a step), rate,
//                           last_rate (its share at the end)
//
// learn.updates, evaluate.every and checkpoint.every are rounded up to multiples of updates_per_step. Overrides of other
// keys, as "task.reward.goal=1", apply to `fly`.
#pragma once

#include <optional>

#include "learn/engine.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::learn {

/// How teachers are distilled into one policy.
struct StudentOptions {
  std::uint64_t teacher_updates = 0;
  int memory = 0;  ///< units of the GRU; 0: none
  std::vector<int> hidden;
  std::size_t rounds = 0, flights = 0, redraw = 0, led = 0, kept = 0, steps = 0, batch = 0;
  double rate = 0, last_rate = 1;
};

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
  std::optional<StudentOptions> student;  ///< none: TD3 alone

  /// Texts of the files by name, as FlyConfig::resolved: train.toml names fly.toml, which names the actor.
  std::map<std::string, std::string> resolved;
  std::string sha256;  ///< SHA-256 of all of them without the number of threads

  /// Factor of the learning rates at an update.
  double rate_share(std::uint64_t update) const;
  /// An actor that has only the name of this task and the names of its inputs and outputs.
  policy::Actor blank_actor() const;
};

/// What decides how many numbers the networks have, as text by key, "networks.critic" and "[64, 64]": of a resolved
/// train.toml, and of an actor, which knows no critics.
using NetworkKeys = std::vector<std::pair<std::string, std::string>>;
NetworkKeys network_keys(const io::Table& root);
NetworkKeys network_keys(const policy::Actor& actor);

/// Throws io::InputError for anything that is missing, unknown, out of range or inconsistent.
TrainConfig read_train_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::learn
