// Flights of a configuration, from their start to their end: whatever flies a fleet does it here. What a flight does depends
// on the number of its flapper alone, so flights may be flown all at once or in parts, on any number of threads.
#pragma once

#include <functional>

#include "io/parallel.hpp"
#include "policy/policy.hpp"
#include "rollout/recorder.hpp"
#include "rollout/settle.hpp"

namespace flappy::rollout {

template <class T>
class Rollout {
 public:
  using Hover = std::vector<flight::Snapshot<T>>;

  /// `count` flights, of the flappers from the configuration's first one on. Its actor acts, or `policy`; where there is
  /// neither, the controller flies alone. Where the task starts settled, flights start from `hover`, which is flown first
  /// while it is empty.
  Rollout(FlyConfig config, std::size_t count, const policy::Policy* policy = nullptr, Hover* hover = nullptr);
  Rollout(const Rollout&) = delete;

  /// Starts an episode of a fleet's flapper `i`: as `hover` flew, or afresh with the vehicle that is sampled for it.
  static void start(flight::Fleet<T>& fleet, const FlyConfig& config, std::size_t i, std::uint32_t episode,
                    const flight::Snapshot<T>* hover);

  const FlyConfig& config() const { return config_; }
  flight::Fleet<T>& fleet() { return fleet_; }
  model::Vehicle vehicle(std::size_t i) const;

  /// Records all flights from now on.
  void record();
  const std::vector<Recorder<T>>& recorders() const { return recorders_; }

  /// One control period. std::invalid_argument for a policy of another task.
  void step();
  std::int64_t tick() const { return tick_; }  ///< control periods so far
  double t_s() const { return static_cast<double>(tick_) * fleet_.period_s(); }
  /// Whether the configuration's duration has been flown.
  bool over() const { return tick_ >= ticks(config_); }
  static std::int64_t ticks(const FlyConfig& config);
  double physics_steps() const;  ///< of all flights

  /// Calls job(i) for every flight, on the fleet's threads.
  void each(const auto& job) { io::parallel_for(fleet_.size(), fleet_.options().batch.threads, job); }

 private:
  void act();

  FlyConfig config_;
  flight::Fleet<T> fleet_;
  const policy::Policy* policy_;
  std::vector<Recorder<T>> recorders_;
  std::int64_t tick_ = 0;
};

extern template class Rollout<float>;
extern template class Rollout<double>;

/// The share of all work that is done, told to who may end it.
struct Progress {
  const std::function<bool(double done)>& keep_going;
  double all, done = 0;

  /// False where the work is to end.
  bool add(double more) { return done += more, !keep_going || keep_going(std::min(1.0, done / all)); }
};

}  // namespace flappy::rollout
