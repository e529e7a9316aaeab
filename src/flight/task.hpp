// What a flapper is to do: where it starts, the path it follows, what it observes, what a policy may add to the
// controller's output or put on the motors, what that earns, and when it ends. Read from configs/tasks/*.toml.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flappy/batch.hpp"
#include "flight/path.hpp"
#include "io/config.hpp"
#include "policy/actor.hpp"
#include "sim/random.hpp"

namespace flappy::flight {

using policy::kMaxActions, policy::kMaxHistory, policy::kMaxObservation;

/// A row of the observation or the action, for who reads or exports it.
struct Signal {
  std::string name, unit;
  double low, high;     ///< expected range; values outside are possible
  std::string frame{};  ///< what its axes are; empty: it has none
};

/// Parts an observation may have, in the order of their bits. Those of a flapper's state are estimated; goal_rotation is the
/// attitude seen from the heading of the set point, previous_action is what the policy adds to the controller's output or puts
/// on the motors, time runs from the start, and trim is what the controller has learnt to hold. The wings' strokes and their
/// rates are true, without noise or delay: as ideal encoders read them at the end of the control period.
enum class Part {
  rotation_matrix,
  position_error,
  velocity,
  body_rate,
  beat_phase,
  heading_error,
  previous_action,
  goal_rotation,
  time,
  trim,
  wings
};

/// What a policy's action is: something that is added to a controller's inputs of the wing beat, in V, V, V and split cycle, or
/// the voltages of the left and the right motor, of which no controller and no wing beat has a part.
enum class ActionKind { wing_beat, voltages };

/// Why an episode ended; bits. A time-out is a truncation, all others are terminations.
enum Ended : std::uint32_t {
  kTimeOut = 1,
  kContact = 2,
  kNotFinite = 4,
  kOutOfBounds = 8,
  kHeadingLate = 16,
  kArrivalLate = 32,
};

/// Terms of the reward, as rows are scored each control period on the true state:
///   C = |a|^2 action + |a - a_prev|^2 action_change + |p| position + |(roll, pitch, yaw)| angles + |v| velocity + |w| rate
///   r = inverse_square / (C^2 + 1e-6) - cost C + facing R'_00 + upright min(0, R'_22) + behind min(0, x + behind_m) + alive
///       + level R'_22 + near s(|p| / near_m) + goal G
/// and once, when it is handed back: arrival G, and at until_s: kept, if the goal was captured and is not lost by then. After the
/// hand-back only who captured the goal earns; what he earns until until_s is the policy's. p, x and R' are relative to the set
/// point, and
///   G = s(|p| / goal_m) s(|v| / goal_m_s) s(|w| / goal_rad_s) s(tilt / goal_tilt) s(heading error / goal_heading)
///   s(x) = 1 / (1 + x^2)
template <class T>
struct Reward {
  T action, action_change, position, angles, velocity, body_rate;
  T inverse_square, cost, facing, upright, behind, behind_m, alive;
  T level, near, near_1_m;
  T goal, arrival, kept, until_s;
  T goal_1_m, goal_s_m, goal_s_rad, goal_1_tilt, goal_1_heading;  // of what G falls off with
};

/// When an episode ends, positions relative to the set point. Unused limits are far away.
template <class T>
struct Limits {
  T time_s;
  T x_low_m, x_high_m, y_m, z_m, distance_m;
  T faced_by_s;                 // after it, R'_00 < 0 ends the episode
  T arrived_by_s, arrived_x_m;  // after it, x < arrived_x_m does
};

/// When a policy is done for good and the controller flies alone, or the robot rests: all at once, or at a time.
template <class T>
struct HandBack {
  T enabled, on_estimate;  // 0 or 1; judged on the true state otherwise
  T x_m, distance_m, speed_x_m_s, speed_m_s, heading_cos, tilt_cos, body_rate_rad_s;
  T at_s;
  T touching;  // 0 or 1: whether a point of contact must touch something, besides
  T rests;     // 0 or 1: the inputs are 0 from then on, and nobody flies
};

/// What makes a flight a success, on the true state at each control tick: it captures the goal, all at once, and later keeps it.
template <class T>
struct Success {
  T by_s, distance_m, speed_m_s, body_rate_rad_s, tilt_cos, heading_cos;          // capture
  T keep_from_s, keep_until_s, keep_distance_m, keep_tilt_cos, keep_heading_cos;  // and after
  T touching;  // 0 or 1: whether a point of contact must touch something at the capture
};

template <class T>
struct TaskConstants {
  T action_low[kMaxActions],
      action_high[kMaxActions];  // what -1 and 1 add, or put on the motors; 0 beyond the action's numbers
  Reward<T> reward;
  Limits<T> limits;
  HandBack<T> hand_back;
  Success<T> success;
  T contact_ends;  // 0 or 1: that the vehicle touches something
  T holds_trim;    // 0 or 1: until it is handed back to, the controller adds no more than the trim it has learnt
  T tick_s;
};

/// Uniform within +-half about the centre.
struct Spread {
  double centre = 0, half = 0;
};

/// Where episodes start.
struct StartRange {
  sim::Start kind = sim::Start::flying;
  bool settled =
      false;  ///< in hover, as a snapshot has it: position and heading are sampled, the rest is the snapshot's
  Spread position_m[3], rotation_rad[3], velocity_m_s[3], body_rate_rad_s[3];
  double x_low_m = -1e9, x_high_m = 1e9;  ///< x is clamped to it
};

struct Task {
  std::string name;
  StartRange start;
  std::vector<Segment<double>> path;
  std::uint32_t parts = 0;          ///< bit of each Part observed
  std::uint32_t history = 1;        ///< observations that a policy sees at once: now, and at its last actions
  std::uint32_t action_repeat = 1;  ///< control periods for which a policy's action stays
  ActionKind action_kind = ActionKind::wing_beat;
  std::string input_unit =
      "V";  ///< of a wing beat's first three inputs; "1" where a vehicle that is known by the beat mixes them
  TaskConstants<double> constants{};
  bool says_contact = false;  ///< whether contact ends it; otherwise it does unless the vehicle has points of contact

  /// Names of the parts observed, with their signals as they are now.
  std::vector<std::pair<std::string, std::vector<Signal>>> observed_parts() const;
  /// All that a policy sees: the parts as they are now, then as they were at each of its last actions, newest first. Before it has
  /// acted so often, the first observation stands for those that are missing.
  std::vector<Signal> observation() const;
  std::vector<Signal> action() const;
  bool sets_voltages() const { return action_kind == ActionKind::voltages; }
  /// Numbers of an action, at most kMaxActions.
  int actions() const { return sets_voltages() ? 2 : 4; }
  /// Nobody acts: not even the middle of the action's range is added.
  void forbid_actions();
  /// Where the episode of this key starts.
  sim::FlapperState sample_start(sim::RandomKey key) const;
};

/// Reads a task. Path times become whole control ticks of `tick_s`.
Task read_task(const io::Table& table, double tick_s);

}  // namespace flappy::flight
