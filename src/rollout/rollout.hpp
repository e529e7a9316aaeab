// A flight depends only on its flapper's number: all flights at once, or in parts, on any number of threads.
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

  /// `count` flights of the flappers from fleet.first_flapper on. The configuration's actor acts, or `policy`; with
  /// neither, the controller alone. If the task starts settled, flights start from `hover`, which is filled first if
  /// empty.
  Rollout(FlyConfig config, std::size_t count, const policy::Policy* policy = nullptr, Hover* hover = nullptr);
  /// A copy flies on from the same state, to the same bytes; it records nothing.
  Rollout(const Rollout& other)
      : config_(other.config_),
        fleet_(other.fleet_),
        policy_(other.policy_),
        memory_(other.memory_),
        tick_(other.tick_) {}

  /// Starts an episode of flapper `i` from the snapshot `hover`, or if null from the task's start with its vehicle.
  static void start(flight::Fleet<T>& fleet, const FlyConfig& config, std::size_t i, std::uint32_t episode,
                    const flight::Snapshot<T>* hover);

  const FlyConfig& config() const { return config_; }
  flight::Fleet<T>& fleet() { return fleet_; }
  model::Vehicle vehicle(std::size_t i) const;

  /// Records all flights from now on.
  void record();
  const std::vector<Recorder<T>>& recorders() const { return recorders_; }

  /// Flies one control period. Throws std::invalid_argument if the policy does not fit the task.
  void step();
  std::int64_t tick() const { return tick_; }  ///< control periods so far
  double t_s() const { return static_cast<double>(tick_) * fleet_.period_s(); }
  bool over() const { return tick_ >= ticks(config_); }
  static std::int64_t ticks(const FlyConfig& config);
  double physics_steps() const;  ///< physics steps so far, summed over flights

  /// Calls job(i) for every flight, on the fleet's threads.
  void each(const auto& job) { io::parallel_for(fleet_.size(), fleet_.options().batch.threads, job); }

 private:
  void act();

  FlyConfig config_;
  flight::Fleet<T> fleet_;
  const policy::Policy* policy_;
  std::vector<float> memory_;  // [flight][unit]: what a recurrent policy remembers
  std::vector<Recorder<T>> recorders_;
  std::int64_t tick_ = 0;
};

extern template class Rollout<float>;
extern template class Rollout<double>;

struct Progress {
  const std::function<bool(double done)>& keep_going;
  double all, done = 0;

  /// Adds finished work. False: the work shall end.
  bool add(double more) { return done += more, !keep_going || keep_going(std::min(1.0, done / all)); }
};

}  // namespace flappy::rollout
