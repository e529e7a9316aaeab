// The reset at the end of an IMU interval, for a block of vehicles that replay one flight (reset_prediction.hpp). The
// recorded motion may differ from vehicle to vehicle, because different errors of sensors may be undone in the log.
// Compiled for each instruction set. A lane is one vehicle of the block.
#pragma once

#include "sim/block.hpp"

namespace flappy::gap {

/// Precision of replays: rounding errors are far below any sensor's noise, and a block holds twice as many vehicles as
/// in double.
using Flown = float;
inline constexpr std::size_t kVehicles = sim::kLanes<Flown>;

/// Recorded motion of the torso origin at a bound of an interval: position, velocity in W, attitude B to W, rate in B.
struct TorsoAt {
  double position_m[3] = {0, 0, 0}, attitude[4] = {1, 0, 0, 0}, velocity_m_s[3] = {0, 0, 0},
         body_rate_rad_s[3] = {0, 0, 0};
};

/// TorsoAt of each vehicle of a block.
struct TorsoRows {
  alignas(64) Flown position_m[3][kVehicles];  ///< [axis][lane]
  alignas(64) Flown attitude[4][kVehicles];
  alignas(64) Flown velocity_m_s[3][kVehicles];
  alignas(64) Flown body_rate_rad_s[3][kVehicles];
};

/// Index of a row in ResetBlockState::rows: what the sensors of each vehicle would have measured over an interval.
enum ResetRow : int {
  kAngularAcceleration = 0,  ///< mean over the interval, simulated less recorded, rad/s^2, B: 3 rows
  kSpecificForce = 3,        ///< mean at the IMU, m/s^2, in the simulated B half-way through the interval: 3 rows
  kStroke = 6,               ///< stroke angle at the end of the interval, rad: left, right
  kRotation = 8,             ///< rotation of the wing, likewise
  kResetRows = 10
};

/// State that a block keeps from one interval to the next, and the rows of the last interval.
struct ResetBlockState {
  alignas(64) Flown imu_velocity_m_s[3][kVehicles];  ///< [axis][lane] of the IMU at the start of the interval, in W
  alignas(64) Flown rows[kResetRows][kVehicles];     ///< [ResetRow][lane]
};

/// Computes the rows of the interval from `from` to `to`, then resets every torso to the recorded motion at `to`; wings
/// keep their state. The body rate is not set to the recorded rate. Instead, the rotation from the simulated to the
/// recorded attitude at `to`, divided by the interval, is added to the rate.
/// `from` null: the start of a flight; no rows, and the body rate is the recorded one. `imu_position_m`: [axis][lane].
using ResetBlock = void (*)(sim::Block<Flown>& block, const TorsoRows* from, const TorsoRows& to, double interval_s,
                            const Flown (*imu_position_m)[kVehicles], double gravity_m_s2, ResetBlockState& kept);

/// Momentum that the wings had at the last call, for a torso that is held.
struct ClampedBlockState {
  alignas(64) Flown momentum_kg_m_s[3][kVehicles];           ///< [axis][lane] of the wings, in B
  alignas(64) Flown angular_momentum_kg_m2_s[3][kVehicles];  ///< about the torso origin
};

/// Computes the rows of an interval for vehicles that are welded to a stand. kSpecificForce and kAngularAcceleration
/// hold the mean force and moment of the wings on the torso, N and Nm in B about the torso origin: (impulse of the air
/// on the wings less their gain of momentum) / interval, likewise for the moment. The other rows hold the wings'
/// angles. Weights are left out: the sensor is zeroed at rest, and the weight of a moving wing changes the moment by
/// 1e-5 Nm only. `interval_s` 0: the start, without rows.
using ClampedBlock = void (*)(sim::Block<Flown>& block, double interval_s, ClampedBlockState& kept,
                              ResetBlockState& rows);

/// Adds a sample, times each weight, to the rows of a beat: the sums of BeatProjection for all lanes. `sample`:
/// [signal][lane], `width` signals; `weights`: [coefficient], `count` of them; `rows`: [coefficient][signal][lane].
template <class Real>
using ProjectBlock = void (*)(const Real* sample, const double* weights, int count, std::size_t width, Real* rows);

}  // namespace flappy::gap
