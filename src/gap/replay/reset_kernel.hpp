// One interval of the IMU for a block of vehicles that all fly one recorded motion: compiled once for each instruction
// set, as the step is.
#pragma once

#include "sim/block.hpp"

namespace flappy::gap {

/// What candidates fly in: rounding is far below any sensor's noise, and a block holds twice as many as in double.
using Flown = float;
/// Vehicles that a flight is predicted by at once: the lanes of a block.
inline constexpr std::size_t kVehicles = sim::kLanes<Flown>;

/// The torso origin where an interval begins or ends; body to world, velocity in W.
struct TorsoAt {
  double position_m[3] = {0, 0, 0}, attitude[4] = {1, 0, 0, 0}, velocity_m_s[3] = {0, 0, 0},
         body_rate_rad_s[3] = {0, 0, 0};
};

/// What a vehicle's sensors would have shown over an interval, as rows of lanes.
enum ResetRow : int {
  kTurning = 0,  ///< mean change of rate over the interval, flown less recorded, rad/s^2, B: 3 rows
  kForce = 3,    ///< mean specific force at the IMU, m/s^2, B as half-way: 3 rows
  kStroke = 6,   ///< at the end, left and right
  kResetRows = 8
};

/// What a block keeps from one interval to the next.
struct ResetBlockState {
  alignas(64) Flown imu_velocity_m_s[3][kVehicles];  ///< in W, where the interval began
  alignas(64) Flown rows[kResetRows][kVehicles];
};

/// Reads what the interval from `from` to `to` gave and puts every torso back onto the record at `to`, wings kept; with
/// `from` null it only puts. The body rate becomes what makes the flown turn the recorded one.
using ResetBlock = void (*)(sim::Block<Flown>& block, const TorsoAt* from, const TorsoAt& to, double interval_s,
                            const double imu_position_m[3], double gravity_m_s2, ResetBlockState& kept);

/// Adds a sample of `width` signals of all lanes to the rows of a beat, each of `weights` times: rows [weight][signal][lane].
using ProjectBlock = void (*)(const Flown* sample, const double* weights, int count, std::size_t width, Flown* rows);

}  // namespace flappy::gap
