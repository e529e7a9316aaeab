// Scores of flights: errors of the true state from the set point, and causes of failure.
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

/// Why a flight failed: the first failure that happened.
enum class FlightFailure {
  none,
  frozen,
  touched_ground,
  touched_wall_or_ceiling,  ///< or a shape of the world
  tipped_over,
  drifted_away,
  never_took_off
};
inline constexpr std::size_t kFlightFailures = 7;
const char* name_of(FlightFailure failure);

inline constexpr double kFarAway_m = 0.3;  // distance from the set point that counts as drifted away
inline constexpr double kTippedOver_rad = 1.0471975511965976;  // 60 degrees

/// Score of one flight, summed over control ticks.
struct FlightScore {
  Errors settled{}, whole{};  ///< sums of squared errors, rad^2 and m^2: since settling, and over the whole flight
  std::size_t settled_ticks = 0, ticks = 0;
  bool crashed = false;  ///< touched the ground in flight, or froze
  bool far_away = false;
  FlightFailure failure = FlightFailure::none;
  double failed_s = 0;

  /// Adds a control tick. `status`: bits of sim::Status since the start.
  void add(const flight::Motion& truth, const flight::Target& target, std::uint32_t status, double t_s,
           bool is_settled);
};

struct FailureCount {
  std::size_t flights = 0;
  std::size_t first_flight = 0;  ///< number of the flight that failed first
  double first_s = 0, median_s = 0, last_s = 0;
};

struct FlightSummary {
  std::size_t flights = 0, crashed = 0, failed = 0;
  Errors settled{},
      takeoff{};  ///< rms errors over all flights that did not crash: since settling, whole; NaN if all crashed
  std::vector<Errors> each;  ///< rms errors since settling of each flight that did not crash and was settled
  double within_share = 0;   ///< share of flights that stayed within kFarAway_m and did not crash
  std::array<FailureCount, kFlightFailures> failures;
};
/// Summarises flights in the given order, so that the result does not depend on threads.
FlightSummary summarise(std::span<const FlightScore> flights);

}  // namespace flappy::rollout
