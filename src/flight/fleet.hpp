// Many flappers in closed loop: bodies, sensors, estimators, controllers and tasks, one control period at a time. As in
// a Batch, every bit of a flapper's flight depends only on its vehicle, its task and its number in the random streams.
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

struct FleetOptions {
  Sensors sensors;
  Controller controller;
  Task task;
  double control_hz = 500;
  std::uint64_t seed = 0;
  std::uint32_t first_flapper = 0;  ///< number of the fleet's first flapper in the random streams
  sim::BatchOptions batch;
};

/// Exploration noise on a policy's actions: first-order autoregressive, in units of the action.
struct Exploration {
  /// Standard deviation for the first and for the last flapper of a fleet; linear in between.
  double low = 0, high = 0;
  double kept = 0;  ///< correlation from one action to the next
};

/// Motion of the torso origin, true or estimated: position, velocity in W, attitude w, x, y, z (B to W), body rate in
/// B.
struct Motion {
  double position_m[3], attitude[4], velocity_m_s[3], body_rate_rad_s[3];
};

struct Target {
  double position_m[3], velocity_m_s[3], acceleration_m_s2[3];
  double heading_cos, heading_sin, heading_rate_rad_s;
};

/// Views of a block after a control period, one number per lane; `observation`: [element][lanes], without history.
template <class T>
struct Shown {
  std::size_t lanes;
  const T *observation, *action_reward, *handed_back;
  const std::uint32_t *ended, *tick;
};

/// A flapper in mid-flight: vehicle, effects, state, sensor biases, and memories of estimator and controller.
template <class T>
struct Snapshot {
  std::vector<T> body, flight;  ///< rows of Block and FlightBlock
  std::uint64_t effects = 0;    ///< bits of the effects in force
  std::vector<T> effect_rows, effect_states;
  std::vector<T> motors;  ///< conductance and back-EMF current of the left and right motor, where energy is metered
  /// Rows and memory of a beat-averaged robot or of one with articulated wings; else empty.
  std::pair<std::vector<T>, std::vector<T>> own;
  std::pair<std::vector<T>, std::vector<T>> contact;  ///< rows and memory of the contact points
  std::uint32_t phase, phase_per_update;
  Target target;  ///< set point at the snapshot
};

template <class T>
class Fleet {
 public:
  /// `count` copies of `vehicle`, each at the start of its episode 0. Throws std::invalid_argument if the control
  /// period is not a whole number of physics steps, if a sensor samples more than once in a physics step, if the task
  /// has no path, or if its actions are motor voltages and there is a controller.
  Fleet(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& options);
  ~Fleet();
  /// A copy flies on from the same state, to the same bytes. Copy it between steps.
  Fleet(const Fleet&);
  Fleet(Fleet&&) noexcept;
  Fleet& operator=(Fleet&&) noexcept;

  std::size_t size() const;
  const FleetOptions& options() const;

  void set_vehicle(std::size_t i, const model::Vehicle& vehicle);
  /// Restarts flapper `i`: at the start state that its task samples for `episode`, or at `state`.
  void start(std::size_t i, std::uint32_t episode);
  void start(std::size_t i, std::uint32_t episode, const sim::FlapperState& state, sim::Start kind);
  /// What estimator, estimate and controller of flapper `i` remember, in the order of the exported C (src/deploy/c:
  /// flappy_estimator, flappy_motion, flappy_feedback); empty where the controller cannot be exported.
  std::vector<double> remembered(std::size_t i) const;
  /// Restarts flapper `i` from a snapshot, moved and turned about z of W to the start of the episode.
  void start(std::size_t i, std::uint32_t episode, const Snapshot<T>& snapshot);
  Snapshot<T> snapshot(std::size_t i) const;

  /// The recurrent actor's memory of flapper `i`, [unit]; empty if the actor is not recurrent.
  std::vector<T> actor_memory(std::size_t i) const;

  /// Sets the actor that acts from now on. With no actor the last actions stay in force. Throws std::invalid_argument
  /// unless its observation and action are those of the task.
  void set_actor(const std::shared_ptr<const policy::Actor>& actor);
  /// Sets the actions of a block's flappers for the next control period: [flapper][element], each in [-1, 1], in
  /// response to the present observations. Use it without an actor, which would overwrite them.
  void set_actions(std::size_t block, const T* actions);
  /// Sets the action of flapper `i` in physical units: offsets to the controller's output, or motor voltages; clipped
  /// to the task's range. Throws std::invalid_argument unless there are as many as the task's actions.
  void set_adds(std::size_t i, std::span<const double> adds);
  /// Sets an offset to the controller's output from now on, for open-loop flight or excitation. Throws
  /// std::invalid_argument for an offset other than 0 if the task's actions are motor voltages.
  void set_added(std::size_t i, const sim::Input& input);

  void set_exploration(const Exploration& exploration);

  /// Flies all flappers through one control period.
  void step();
  /// step() in parts: begin() plans `periods` control periods; fly_block() then flies one block through all of them, to
  /// be called once for each block, in any order and on any thread; end() closes them.
  void begin(int periods);
  void fly_block(std::size_t block);
  void end();
  std::size_t blocks() const;
  /// Range of flappers in a block: first, and one after the last.
  std::pair<std::size_t, std::size_t> flappers(std::size_t block) const;
  Shown<T> shown(std::size_t block) const;

  Motion truth(std::size_t i) const;
  Motion estimate(std::size_t i) const;
  Target target(std::size_t i) const;
  /// Wing-beat input as controller and actor last set it, before clipping. Without meaning if actions are voltages.
  sim::Input input(std::size_t i) const;
  double reward(std::size_t i) const;
  std::uint32_t ended(std::size_t i) const;  ///< bits of Ended, since the start
  /// Bits of sim::Status that are events, since the start. Contact is not an event for a vehicle with contact points
  /// whose task does not end on contact.
  std::uint32_t events(std::size_t i) const;
  std::uint32_t tick(std::size_t i) const;  ///< control periods since the start
  bool handed_back(std::size_t i) const;
  double captured_s(std::size_t i) const;  ///< time at which the goal was first captured; 0: not yet
  double lost_s(std::size_t i) const;      ///< time at which the goal was first not kept as the task demands; 0: never
  /// Observation with its history, newest first.
  std::vector<double> observation(std::size_t i) const;
  void observation(std::size_t i, T* row) const;
  /// Last action of the policy with its noise, in [-1, 1]; 0 beyond the task's actions.
  std::array<T, kMaxActions> action(std::size_t i) const;
  /// Last action in physical units, also of one that is late: offset to the controller's output, or motor voltages; 0
  /// beyond the task's actions.
  std::array<T, kMaxActions> adds(std::size_t i) const;
  T action_reward(std::size_t i) const;  ///< sum of rewards since the last action of the actor or set_actions()
  /// Normalised squared innovations of the last mocap pose: angle and position, three degrees of freedom each.
  std::pair<double, double> innovation(std::size_t i) const;
  std::array<double, 3> gyro_bias_rad_s(std::size_t i) const;  ///< true
  /// Low-passed IMU signal without noise and bias, in B: rates in rad/s, specific force in m/s^2.
  std::pair<std::array<double, 3>, std::array<double, 3>> felt(std::size_t i) const;

  sim::Batch<T>& batch();
  const sim::Batch<T>& batch() const;
  double period_s() const;

  /// Adds the processor cycles of each Stage (flight_block.hpp) to cycles[Stage] from now on; for fleets on one thread.
  void count_cycles(std::uint64_t* cycles);

  /// Samples of the last control period; empty without record(true) before it. With mocap_delay or jitter, the poses that
  /// arrived in it, because a negative delay is known only then.
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

  /// All memory that changes in flight. After writing to it, call restored() with the control periods flown.
  std::vector<std::span<std::byte>> memory();
  void restored(std::int64_t periods);
  std::int64_t periods() const;  ///< control periods flown so far

  std::uint64_t hash(std::size_t first, std::size_t last) const;
  std::uint64_t hash() const { return hash(0, size()); }
  /// Memory of sensors, estimator, controller and task; add Batch::bytes_per_flapper() for the body.
  std::size_t bytes_per_flapper() const;

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

extern template class Fleet<float>;
extern template class Fleet<double>;

}  // namespace flappy::flight
