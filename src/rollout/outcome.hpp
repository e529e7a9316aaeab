// Outcomes of flights, judged on the instantaneous true state at each control tick, not averaged over a beat.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "flight/fleet.hpp"

namespace flappy::rollout {

/// Why a flight failed: the first event that made success impossible.
enum class TaskFailure {
  none,
  not_finite,
  crashed,        ///< touched ground, wall, ceiling or a shape
  out_of_bounds,  ///< ended by flight::kOutOfBounds
  too_late,       ///< ended by flight::kHeadingLate or kArrivalLate
  never_captured,
  lost_position,
  lost_tilt,
  lost_heading
};
inline constexpr std::size_t kTaskFailures = 9;
const char* name_of(TaskFailure failure);

/// Demands of a capture, which must all hold at once.
enum class Demand { distance, speed, body_rate, tilt, heading };
inline constexpr std::size_t kDemands = 5;
const char* name_of(Demand demand);

/// The strict goal of the escape (the study's first end condition).
inline constexpr double kStrictDistance_m = 0.03, kStrictSpeed_m_s = 0.3, kStrictBodyRate_rad_s = 5;
inline constexpr double kStrictCos = 0.9396926207859084;  // cosine of 20 degrees, limit of tilt and of heading error

struct Outcome {
  double captured_s = 0, lost_s = 0;    ///< 0: never
  std::uint32_t status = 0, ended = 0;  ///< bits of sim::Status and of flight::Ended
  bool success() const;

  // only for flights with an OutcomeMonitor
  TaskFailure failure = TaskFailure::none;
  Demand missing = Demand::distance;  ///< worst demand at the closest moment of a flight that never captured
  double strict_s = 0;                ///< time at which the strict goal was first reached; 0: never
  double overshoot_m = 0;             ///< largest distance beyond the goal between capture and keep_from_s
  double position_error_m = 0, heading_error_rad = 0;  ///< at the end
  /// Energy of both wings' drives, and its duration, until the hand-back or the latest time of capture; NaN energy for
  /// beat-averaged vehicles.
  double energy_J = 0, manoeuvre_s = 0;

  std::uint64_t hash = 0;  ///< hash of the final motion state; also without a monitor
};

class OutcomeMonitor {
 public:
  OutcomeMonitor(const flight::Task& task, const flight::Motion& start, const flight::Target& goal);

  /// Adds a control tick. `so_far`: captured_s, lost_s, status and ended up to this tick.
  void see(const flight::Motion& truth, const flight::Target& goal, double t_s, const Outcome& so_far);
  /// Whether the energy of this tick counts. Call it before spend().
  bool manoeuvring(double t_s) const;
  void spend(double energy_J, double period_s, bool handed_back);
  void finish(Outcome& outcome) const;

 private:
  flight::Success<double> success_;
  double way_[3];  // unit vector from start to goal
  double least_ = 1e300;
  TaskFailure failure_ = TaskFailure::none;
  Demand missing_ = Demand::distance;
  bool handed_back_ = false;
  double strict_s_ = 0, overshoot_m_ = 0, position_error_m_ = 0, facing_ = 1, aside_ = 0;
  double energy_J_ = 0, manoeuvre_s_ = 0;
};

/// A proportion and its 95 % interval (Wilson 1927).
struct Rate {
  double value = 0, low = 0, high = 1;
};
Rate rate_of(std::size_t successes, std::size_t flights);

/// Empty without flights; infinite where a flight never reached the goal.
struct Quantiles {
  std::optional<double> p10, median, p90;
};

struct Summary {
  std::size_t flights = 0;
  Rate success, captured, strict;
  Quantiles capture_s;    ///< over flights that captured
  Quantiles strict_s;     ///< over all flights; infinite for flights that never reached the strict goal
  Quantiles overshoot_m;  ///< over flights that captured
  /// Over all flights; energy and power only where energy is modelled.
  Quantiles position_error_m, heading_error_rad, energy_J, power_W;
  std::array<std::size_t, kTaskFailures> failures{};  ///< counts by TaskFailure; none: successes
  std::array<std::size_t, kDemands> missing{};        ///< counts by Demand of the flights that never captured
  std::uint64_t hash = 0;                             ///< hash of all outcomes in order
};
Summary summarise(std::span<const Outcome> flights);

}  // namespace flappy::rollout
