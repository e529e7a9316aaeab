// A configuration as environments of reinforcement learning: one action of all in, one transition of each out, episode after
// episode. Environment i, given its actions, depends on the seed, on i and on which episode it is in: not on how many there are, nor
// on threads. Its sensors keep the time of the last reset of all, so an episode that begins later begins at another moment between
// two of their samples.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

/// When an environment whose episode is over starts the next: at the end of the step that ended it, in the step after that, whose
/// action is not used, or when it is reset.
enum class Autoreset { same_step, next_step, disabled };

struct EnvironmentOptions {
  std::size_t count = 1;
  Autoreset autoreset = Autoreset::same_step;
};

/// Where a step of all environments is written, a row for each.
struct Transitions {
  float* observation;  ///< [count][observations]
  float* reward;       ///< [count]: of all control periods of the step
  bool* terminated;    ///< [count]: the task is over: a crash, out of bounds, or handed back and paid
  bool* truncated;     ///< [count]: its time is over
};

/// What the episode that an environment ended last was; where none has ended, nothing.
struct EndedEpisode {
  float episode_return = 0, length = 0;  ///< length: steps
  bool success = false;                  ///< as the task says; where it does not: nothing ended it before its time
  std::uint32_t causes = 0;              ///< bits of flight::Ended; 0: handed back
};

class Environments {
 public:
  virtual ~Environments() = default;

  virtual const FlyConfig& config() const = 0;
  std::size_t count() const { return options_.count; }
  const EnvironmentOptions& options() const { return options_; }
  /// Names, units and what is accepted: observations are clamped to ten times the range in which a vehicle flies, actions are in
  /// [-1, 1] and stand for the signals' ranges.
  const std::vector<flight::Signal>& observed() const { return observed_; }
  const std::vector<flight::Signal>& actions() const { return actions_; }
  double step_s() const { return step_s_; }  ///< of one action

  /// Starts all anew, and their sensors: with a seed their episode 0, as flappy-fly flies it, else each its next one.
  virtual void reset(std::optional<std::uint64_t> seed, float* observation) = 0;
  /// Starts the next episode of those that are named; writes their rows alone.
  virtual void reset(std::span<const bool> which, float* observation) = 0;
  /// One action of each, [count][actions()]. Numbers outside [-1, 1] are clamped. How many ended.
  virtual std::size_t step(const float* action, const Transitions& to) = 0;

  /// Of those that ended in the last step: bits for each environment, how it went, and its last observation.
  std::span<const bool> ended() const { return {ended_.get(), count()}; }
  std::span<const EndedEpisode> episodes() const { return episodes_; }
  const float* final_observation() const { return final_observation_.data(); }

  virtual flight::Motion truth(std::size_t i) const = 0;
  virtual flight::Motion estimate(std::size_t i) const = 0;
  virtual flight::Target target(std::size_t i) const = 0;
  virtual sim::FlapperState state(std::size_t i) const = 0;
  virtual double time_s(std::size_t i) const = 0;
  virtual std::uint32_t episode(std::size_t i) const = 0;
  /// Of how vehicles [first, last) move, as flappy-fly prints it.
  virtual std::uint64_t hash(std::size_t first, std::size_t last) const = 0;

 protected:
  Environments(const FlyConfig& config, const EnvironmentOptions& options);

  EnvironmentOptions options_;
  std::vector<flight::Signal> observed_, actions_;
  double step_s_;
  std::unique_ptr<bool[]> ended_;
  std::vector<EndedEpisode> episodes_;
  std::vector<float> final_observation_;
};

/// io::InputError where the configuration has an excitation that changes, which belongs to flights and not to actions.
std::unique_ptr<Environments> make_environments(FlyConfig config, const EnvironmentOptions& options);

}  // namespace flappy::rollout
