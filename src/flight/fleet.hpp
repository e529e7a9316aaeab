// Many flappers in closed loop: bodies, sensors, estimators, controllers and tasks, one control period at a time. The
// bytes of a flapper depend on its vehicle, its task and its place in the random streams, as those of a Batch do.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "flight/setup.hpp"
#include "flight/task.hpp"
#include "policy/actor_file.hpp"

namespace flappy::flight {

template <class T>
struct Tap;

/// What is common to all flappers of a fleet.
struct FleetOptions {
  Sensors sensors;
  Controller controller;
  Task task;
  double control_hz = 500;
  std::uint64_t seed = 0;
  std::uint32_t first_flapper = 0;  ///< number of the fleet's first flapper in the random streams
  sim::BatchOptions batch;
};

/// Noise on a policy's actions: an autoregressive one of first order, in units of the action.
struct Exploration {
  double low = 0, high = 0;  ///< standard deviation of the first and of the last flapper of a fleet
  double kept = 0;           ///< correlation from one action to the next
};

/// A flapper's motion, true or estimated. SI units; attitude w, x, y, z, body to world.
struct Motion {
  double position_m[3], attitude[4], velocity_m_s[3], body_rate_rad_s[3];
};

/// Where a flapper is meant to be.
struct Target {
  double position_m[3], velocity_m_s[3], acceleration_m_s2[3];
  double heading_cos, heading_sin, heading_rate_rad_s;
};

/// What the flappers of a block show after a period, each list one number for each; a number of the observation is `lanes` after the
/// one before it. Of observations with a history, the present.
template <class T>
struct Shown {
  std::size_t lanes;
  const T *observation, *action_reward, *handed_back;
  const std::uint32_t *ended, *tick;
};

/// A flapper in mid-flight: its vehicle with its effects, state, sensors' biases, and what estimator and controller have learnt.
template <class T>
struct Snapshot {
  std::vector<T> body, flight;  ///< rows of Block and FlightBlock
  std::uint64_t effects = 0;    ///< in force
  std::vector<T> effect_rows, effect_states;
  std::vector<T> motors;  ///< conductance and back-EMF's current of left and right, where energy is metered
  /// Rows and memory of a robot that is known by the beat, or has four angles a wing.
  std::pair<std::vector<T>, std::vector<T>> own;
  std::pair<std::vector<T>, std::vector<T>> contact;  ///< the same of points of contact
  std::uint32_t phase, phase_per_update;
  Target target;  ///< where it was meant to be
};

template <class T>
class Fleet {
 public:
  /// `count` copies of `vehicle`, each at the start of its episode 0. std::invalid_argument where the control period is no
  /// whole number of physics steps, a sensor is faster than they are, the task has no path, or it is one of voltages and there is
  /// a controller.
  Fleet(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& options);
  ~Fleet();
  Fleet(Fleet&&) noexcept;
  Fleet& operator=(Fleet&&) noexcept;

  std::size_t size() const;
  const FleetOptions& options() const;

  void set_vehicle(std::size_t i, const model::Vehicle& vehicle);
  /// Starts flapper `i` anew where its task starts episode `episode`, or at `state`.
  void start(std::size_t i, std::uint32_t episode);
  void start(std::size_t i, std::uint32_t episode, const sim::FlapperState& state, sim::Start kind);
  /// Starts flapper `i` as the snapshot flew, moved and turned about z to where its task starts the episode.
  void start(std::size_t i, std::uint32_t episode, const Snapshot<T>& snapshot);
  Snapshot<T> snapshot(std::size_t i) const;

  /// The actor that acts from now on, or none: then the last actions stay. std::invalid_argument unless its observation and
  /// action are those of the task.
  void set_actor(const std::shared_ptr<const policy::Actor>& actor);
  /// Actions of all flappers of a block for the next period, row after row, each number in [-1, 1], for what they observe now; an actor
  /// would overwrite them.
  void set_actions(std::size_t block, const T* actions);
  /// The action of flapper `i` by what it adds to the controller's output, or the voltages that it sets, each within the task's range.
  /// std::invalid_argument unless they are as many as the task's actions.
  void set_adds(std::size_t i, std::span<const double> adds);
  /// Adds to the controller's output from now on: open-loop flight, excitation. std::invalid_argument for anything but nothing
  /// where the task is one of voltages.
  void set_added(std::size_t i, const sim::Input& input);

  /// Noise on the actor's actions from now on.
  void set_exploration(const Exploration& exploration);

  /// One control period for all.
  void step();
  /// The same in parts: begin() plans `periods` control periods, then fly_block() takes a block of flappers through all of
  /// them, each block once, in any order and on any thread, and end() closes them.
  void begin(int periods);
  void fly_block(std::size_t block);
  void end();
  std::size_t blocks() const;
  /// Flappers of a block: the first, and the one after the last.
  std::pair<std::size_t, std::size_t> flappers(std::size_t block) const;
  Shown<T> shown(std::size_t block) const;

  Motion truth(std::size_t i) const;
  Motion estimate(std::size_t i) const;
  Target target(std::size_t i) const;
  /// As the controller and actor last set it, before the driver clips it; nothing where the task is one of voltages.
  sim::Input input(std::size_t i) const;
  double reward(std::size_t i) const;
  std::uint32_t ended(std::size_t i) const;  ///< bits of Ended, since the start
  /// Bits of sim::Status that are events, since the start: of a vehicle with points of contact whose task does not end by it, touching
  /// is none.
  std::uint32_t events(std::size_t i) const;
  std::uint32_t tick(std::size_t i) const;  ///< control periods since the start
  bool handed_back(std::size_t i) const;
  double captured_s(std::size_t i) const;  ///< when the goal was first captured; 0: not yet
  double lost_s(std::size_t i) const;      ///< when it was first not kept, as the task asks; 0: never
  std::vector<double> observation(std::size_t i) const;
  void observation(std::size_t i, T* row) const;
  /// Of the policy, its noise included, and what that adds to the controller's output, or the voltages that it sets: numbers of the
  /// task's actions, then zeros.
  std::array<T, kMaxActions> action(std::size_t i) const;
  std::array<T, kMaxActions> adds(std::size_t i) const;
  T action_reward(std::size_t i) const;  ///< rewards since the policy last acted, or was told how
  /// Squared innovations of the last pose over their variance: angle and position, three degrees of freedom each.
  std::pair<double, double> innovation(std::size_t i) const;
  std::array<double, 3> gyro_bias_rad_s(std::size_t i) const;  ///< true
  /// What the IMU means of late, without noise and bias: rates, rad/s, and specific force, m/s^2, in B.
  std::pair<std::array<double, 3>, std::array<double, 3>> felt(std::size_t i) const;

  sim::Batch<T>& batch();
  const sim::Batch<T>& batch() const;
  double period_s() const;

  /// Counts processor cycles of each Stage (flight_block.hpp) into `cycles` from now on; for fleets on one thread.
  void count_cycles(std::uint64_t* cycles);

  /// What a recorder sees of the last period's samples: none unless record(true) came before it. Poses of a flapper with a
  /// mocap_delay are those that arrived, as one that is early is known no sooner.
  struct ImuRecord {
    double arrival_s, gyro_rad_s[3], accel_m_s2[3];
  };
  struct MocapRecord {
    double arrival_s, position_m[3], attitude[4];
    bool valid;  // the tracker saw the flapper
  };
  void record(bool on);
  std::vector<ImuRecord> imu_samples(std::size_t i) const;
  std::vector<MocapRecord> mocap_samples(std::size_t i) const;

  /// All that changes in flight, for who keeps and restores it: then restored() must follow, with the control periods
  /// flown.
  std::vector<std::span<std::byte>> memory();
  void restored(std::int64_t periods);
  std::int64_t periods() const;  ///< flown so far

  std::uint64_t hash(std::size_t first, std::size_t last) const;
  std::uint64_t hash() const { return hash(0, size()); }
  /// Of sensors, estimator, controller and task, beyond Batch::bytes_per_flapper().
  std::size_t bytes_per_flapper() const;

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

extern template class Fleet<float>;
extern template class Fleet<double>;

}  // namespace flappy::flight
