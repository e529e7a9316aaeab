// Task of a flapper: start, path, observation, action of the policy (offset to the controller's output, or motor
// voltages), reward and end. Read from configs/tasks/*.toml.
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

/// Description of one element of the observation or the action.
struct Signal {
  std::string name, unit;
  double low, high;        ///< expected range; values outside are possible
  std::string frame{};     ///< frame of its axes; empty: none
  std::string positive{};  ///< what a positive value means; empty: not signed
};

/// Parts of an observation, in the order of their bits.
///   rotation_matrix, position_error, velocity, body_rate, heading_error   from the estimate
///   beat_phase        sine and cosine of the phase of the wing beat
///   goal_rotation     estimated attitude in the set point's heading frame
///   previous_action   offset of the policy to the controller's output, or its motor voltages
///   time              since the start, s
///   trim              inputs that the controller has learnt to hold
///   wings             true stroke angles and rates at the end of the control period, as ideal encoders read them
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

/// Meaning of a policy's action: an offset to the controller's wing-beat inputs (V, V, V, split cycle), or the voltages
/// of the left and the right motor, without any controller or wing beat.
enum class ActionKind { wing_beat, voltages };

/// Why an episode ended, as bits. A time-out is a truncation, all others are terminations.
enum Ended : std::uint32_t {
  kTimeOut = 1,
  kContact = 2,
  kNotFinite = 4,
  kOutOfBounds = 8,
  kHeadingLate = 16,
  kArrivalLate = 32,
};

/// Weights of the reward. Each control period is scored on the true state:
///   C = |a|^2 action + |a - a_prev|^2 action_change + |p| position + |(roll, pitch, yaw)| angles + |v| velocity
///       + |w| rate
///   r = inverse_square / (C^2 + 1e-6) - cost C + facing R'_00 + upright min(0, R'_22) + behind min(0, x + behind_m)
///       + alive + level R'_22 + near s(|p| / near_m) + goal G
/// It also earns arrival G once, at the hand-back, and `kept` once, at until_s, if the goal was captured and not lost.
/// If until_s > 0, a flapper without capture earns 0 after the hand-back; later rewards, up to until_s, count for the
/// policy. p, x and R' are relative to the set point, and
///   G = s(|p| / goal_m) s(|v| / goal_m_s) s(|w| / goal_rad_s) s(tilt / goal_tilt) s(heading error / goal_heading)
///   s(x) = 1 / (1 + x^2)      near_1_m, goal_1_.., goal_s_..: reciprocals of near_m, goal_m and so on
template <class T>
struct Reward {
  T action, action_change, position, angles, velocity, body_rate;
  T inverse_square, cost, facing, upright, behind, behind_m, alive;
  T level, near, near_1_m;
  T goal, arrival, kept, until_s;
  T goal_1_m, goal_s_m, goal_s_rad, goal_1_tilt, goal_1_heading;
};

/// Limits at which an episode ends; positions relative to the set point. Unused limits are 1e9.
template <class T>
struct Limits {
  T time_s;
  T x_low_m, x_high_m, y_m, z_m, distance_m;
  T faced_by_s;                 // R'_00 < 0 after this time ends the episode
  T arrived_by_s, arrived_x_m;  // x < arrived_x_m after arrived_by_s ends the episode
};

/// When the policy hands back for good, to the controller or to rest: when all bounds hold at once, or at at_s.
template <class T>
struct HandBack {
  T enabled, on_estimate;  // 0 or 1; on_estimate: judged on the estimated state, else on the true one
  T x_m, distance_m, speed_x_m_s, speed_m_s, heading_cos, tilt_cos, body_rate_rad_s;
  T at_s;
  T touching;  // 0 or 1: in addition, a contact point must touch something
  T rests;     // 0 or 1: the inputs are 0 after the hand-back
};

/// Bounds of a success, judged on the true state at each tick. Captured: all its bounds hold at once, by by_s. Kept:
/// the bounds of keeping hold at all ticks from keep_from_s to keep_until_s.
template <class T>
struct Success {
  T by_s, distance_m, speed_m_s, body_rate_rad_s, tilt_cos, heading_cos;          // capture
  T keep_from_s, keep_until_s, keep_distance_m, keep_tilt_cos, keep_heading_cos;  // keeping
  T touching;  // 0 or 1: a contact point must touch something at the capture
};

template <class T>
struct TaskConstants {
  T action_low[kMaxActions], action_high[kMaxActions];  // offset or voltage for -1 and 1; 0 beyond the task's actions
  Reward<T> reward;
  Limits<T> limits;
  HandBack<T> hand_back;
  Success<T> success;
  T contact_ends;  // 0 or 1: contact ends the episode
  T holds_trim;    // 0 or 1: before the hand-back, the controller's output is its learnt trim
  T tick_s;
};

/// Uniform distribution within +-half about the centre.
struct Spread {
  double centre = 0, half = 0;
};

struct StartRange {
  sim::Start kind = sim::Start::flying;
  bool settled = false;  ///< starts from the snapshot of a hover; only position and heading are sampled
  Spread position_m[3], rotation_rad[3], velocity_m_s[3], body_rate_rad_s[3];
  double x_low_m = -1e9, x_high_m = 1e9;  ///< bounds to which the sampled x is clamped
};

struct Task {
  std::string name;
  StartRange start;
  std::vector<Segment<double>> path;
  std::uint32_t parts = 0;          ///< observed parts, bits of Part
  std::uint32_t history = 1;        ///< number of observations that a policy sees at once: now, and at its last actions
  std::uint32_t action_repeat = 1;  ///< control periods per action of the policy
  /// Most control periods by which an action acts later: each draws its own number from 0 to this, uniform.
  std::uint32_t action_late_most = 0;
  bool action_late_drawn = false;  ///< each flight draws its own action_late_most, uniform from 0 to this one
  ActionKind action_kind = ActionKind::wing_beat;
  /// Unit of the first three wing-beat inputs; "1" for vehicles without motors, which mix them.
  std::string input_unit = "V";
  TaskConstants<double> constants{};
  /// Whether the task file sets end.contact. If not, contact ends the episode unless the vehicle has contact points.
  bool says_contact = false;

  /// Observed parts with the signals of one observation, without history.
  std::vector<std::pair<std::string, std::vector<Signal>>> observed_parts() const;
  /// All signals that a policy sees: the present observation, then those at its last actions, newest first. At the
  /// start, the first observation takes the place of earlier ones.
  std::vector<Signal> observation() const;
  std::vector<Signal> action() const;
  bool sets_voltages() const { return action_kind == ActionKind::voltages; }
  /// Elements of an action, at most kMaxActions.
  int actions() const { return sets_voltages() ? 2 : 4; }
  /// Sets the range of actions to 0, for flights without a policy: an action of 0 would add the middle of the range.
  void forbid_actions();
  /// Samples the start state of the episode that `key` names.
  sim::FlapperState sample_start(sim::RandomKey key) const;
};

/// Reads a task. Times of the path are rounded to whole control ticks of `tick_s`. Throws io::InputError.
Task read_task(const io::Table& table, double tick_s);

}  // namespace flappy::flight
