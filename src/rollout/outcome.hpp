// What became of flights of a task that says what a success is. Judged on the true state at each control tick, instantaneous:
// nothing is averaged over a wing beat.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "flight/fleet.hpp"

namespace flappy::rollout {

/// Why a flight failed: what first put success out of reach.
enum class TaskFailure {
  none,
  not_finite,
  crashed,        ///< touched ground, wall or ceiling
  out_of_bounds,  ///< its task ended there, as in the next
  too_late,
  never_captured,
  lost_position,
  lost_tilt,
  lost_heading
};
inline constexpr std::size_t kTaskFailures = 9;
const char* name_of(TaskFailure failure);

/// What a capture asks for, all at once.
enum class Demand { distance, speed, body_rate, tilt, heading };
inline constexpr std::size_t kDemands = 5;
const char* name_of(Demand demand);

/// The strict goal of the escape (the study's first end condition).
inline constexpr double kStrictDistance_m = 0.03, kStrictSpeed_m_s = 0.3, kStrictBodyRate_rad_s = 5;
inline constexpr double kStrictCos = 0.9396926207859084;  // of 20 degrees: of tilt and of heading

struct Outcome {
  double captured_s = 0, lost_s = 0;    ///< 0: never
  std::uint32_t status = 0, ended = 0;  ///< bits of sim::Status and of flight::Ended
  bool success() const;

  // The rest of monitored flights only.
  TaskFailure failure = TaskFailure::none;
  Demand missing = Demand::distance;  ///< what was missing most at the closest moment of a flight that never captured
  double strict_s = 0;                ///< when the strict goal was first reached; 0: never
  double overshoot_m = 0;             ///< of a flight that captured
  double position_error_m = 0, heading_error_rad = 0;  ///< at the end
  /// Electrical, of both motors, until hand-back or until capture is too late; not a number where no voltage is modelled.
  double energy_J = 0, manoeuvre_s = 0;

  std::uint64_t hash = 0;  ///< of how the vehicle moves, at the end
};

/// Sees one flight, tick by tick, and says what became of it.
class OutcomeMonitor {
 public:
  /// At the start of the flight.
  OutcomeMonitor(const flight::Task& task, const flight::Motion& start, const flight::Target& goal);

  /// A tick as the fleet shows it; `so_far`: captured_s, lost_s, status and ended by then.
  void see(const flight::Motion& truth, const flight::Target& goal, double t_s, const Outcome& so_far);
  /// Whether its energy counts at this tick: call it before spend(), which adds the tick's.
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

/// A rate and its 95 % interval (Wilson 1927).
struct Rate {
  double value = 0, low = 0, high = 1;
};
Rate rate_of(std::size_t successes, std::size_t flights);

/// 10 %, median and 90 %; nothing where there is no flight, infinite where it is one that never got there.
struct Quantiles {
  std::optional<double> p10, median, p90;
};

struct Summary {
  std::size_t flights = 0;
  Rate success, captured, strict;
  Quantiles capture_s;    ///< of flights that captured
  Quantiles strict_s;     ///< of all; infinite for those that never reached it
  Quantiles overshoot_m;  ///< of flights that captured
  Quantiles position_error_m, heading_error_rad, energy_J, power_W;  ///< of all; no energy where no voltage is modelled
  std::array<std::size_t, kTaskFailures> failures{};                 ///< by TaskFailure; none: the successes
  std::array<std::size_t, kDemands> missing{};                       ///< by Demand, of those that never captured
  std::uint64_t hash = 0;                                            ///< of all outcomes in order
};
Summary summarise(std::span<const Outcome> flights);

}  // namespace flappy::rollout
