// A configuration as environments of reinforcement learning. Environment i depends only on its actions, the seed, i and
// its episode number, not on the number of environments or threads. Sensor clocks run on from the last reset of all, so
// a later episode may begin at another moment between two samples.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

/// When an environment whose episode is over starts the next one: at the end of the step that ended it; in the
/// following step, whose action is ignored; or on reset().
enum class Autoreset { same_step, next_step, disabled };

struct EnvironmentOptions {
  std::size_t count = 1;
  Autoreset autoreset = Autoreset::same_step;
};

struct Transitions {
  float* observation;  ///< [count][observations]
  float* reward;       ///< [count]: sum over the control periods of the step
  /// [count]: ended by a rule of the task (any flight::Ended but time-out), or handed back and past until_s.
  bool* terminated;
  bool* truncated;  ///< [count]: ended by time-out
};

/// Result of the last episode that an environment ended; default values before the first.
struct EndedEpisode {
  float episode_return = 0, length = 0;  ///< length: steps
  bool success = false;      ///< as the task defines it; without a definition: ended by time-out or hand-back
  std::uint32_t causes = 0;  ///< bits of flight::Ended; 0: handed back
};

class Environments {
 public:
  virtual ~Environments() = default;
  /// A copy flies on from the same state, to the same bytes; nobody watches it.
  virtual std::unique_ptr<Environments> copy() const = 0;

  virtual const FlyConfig& config() const = 0;
  std::size_t count() const { return options_.count; }
  const EnvironmentOptions& options() const { return options_; }
  /// Observed signals; low and high bound the observations: ten times the range of a flying vehicle.
  const std::vector<flight::Signal>& observed() const { return observed_; }
  /// Action signals; low and high are the physical values of actions -1 and 1.
  const std::vector<flight::Signal>& actions() const { return actions_; }
  double step_s() const { return step_s_; }  ///< duration of one action

  /// Restarts all and their sensor clocks: with a seed at episode 0, as flappy-fly flies it; else at their next
  /// episode.
  virtual void reset(std::optional<std::uint64_t> seed, float* observation) = 0;
  /// Starts the next episode of the environments in `which`; writes only their rows of `observation`.
  virtual void reset(std::span<const bool> which, float* observation) = 0;
  /// Flies all for one action, [count][actions()], clamped to [-1, 1]. Returns the number of episodes that ended.
  virtual std::size_t step(const float* action, const Transitions& to) = 0;

  /// [count]: whether the episode of each environment ended in the last step.
  std::span<const bool> ended() const { return {ended_.get(), count()}; }
  /// [count]: results of the episodes that ended last.
  std::span<const EndedEpisode> episodes() const { return episodes_; }
  /// [count][observations]: last observations of the episodes that ended last.
  const float* final_observation() const { return final_observation_.data(); }

  virtual flight::Motion truth(std::size_t i) const = 0;
  virtual flight::Motion estimate(std::size_t i) const = 0;
  virtual flight::Target target(std::size_t i) const = 0;
  virtual sim::FlapperState state(std::size_t i) const = 0;
  virtual double time_s(std::size_t i) const = 0;
  virtual std::uint32_t episode(std::size_t i) const = 0;
  /// Hash of the motion of vehicles [first, last), as flappy-fly prints it.
  virtual std::uint64_t hash(std::size_t first, std::size_t last) const = 0;

 protected:
  Environments(const FlyConfig& config, const EnvironmentOptions& options);
  Environments(const Environments& other);

  EnvironmentOptions options_;
  std::vector<flight::Signal> observed_, actions_;
  double step_s_;
  std::unique_ptr<bool[]> ended_;
  std::vector<EndedEpisode> episodes_;
  std::vector<float> final_observation_;
};

/// Throws io::InputError if the configuration has an excitation that changes in time: actions take its place.
std::unique_ptr<Environments> make_environments(FlyConfig config, const EnvironmentOptions& options);

}  // namespace flappy::rollout
