// How well flights went: errors of the true state against the set point, and what became of those that failed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flight/fleet.hpp"

namespace flappy::rollout {

/// Roll, pitch, yaw about the commanded heading (ZYX), x, y, z; rad and m.
using Errors = std::array<double, 6>;
Errors errors_of(const flight::Motion& truth, const flight::Target& target);

/// Why a flight failed: the first of these that happened to it.
enum class FlightFailure {
  none,
  frozen,
  touched_ground,
  touched_wall_or_ceiling,
  tipped_over,
  drifted_away,
  never_took_off
};
inline constexpr std::size_t kFlightFailures = 7;
const char* name_of(FlightFailure failure);

inline constexpr double kFarAway_m = 0.3;                      // from the set point: no longer where it is meant to be
inline constexpr double kTippedOver_rad = 1.0471975511965976;  // 60 degrees

/// One flight, tick by tick.
struct FlightScore {
  Errors settled{}, whole{};  ///< sums of squares
  std::size_t settled_ticks = 0, ticks = 0;
  bool crashed = false;  ///< touched the ground in flight, or froze
  bool far_away = false;
  FlightFailure failure = FlightFailure::none;
  double failed_s = 0;

  /// `status`: bits of sim::Status so far.
  void add(const flight::Motion& truth, const flight::Target& target, std::uint32_t status, double t_s,
           bool is_settled);
};

struct FailureCount {
  std::size_t flights = 0;
  std::size_t first_flight = 0;  ///< that failed first
  double first_s = 0, median_s = 0, last_s = 0;
};

struct FlightSummary {
  std::size_t flights = 0, crashed = 0, failed = 0;
  Errors settled{},
      takeoff{};            ///< root mean squares over all flights that did not crash; not a number where there is none
  double within_share = 0;  ///< never farther than kFarAway_m and not crashed
  std::array<FailureCount, kFlightFailures> failures;
};
/// In the order of flights, whoever flew them.
FlightSummary summarise(std::span<const FlightScore> flights);

}  // namespace flappy::rollout
