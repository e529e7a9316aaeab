// Undoes effects of sensors in a log, so that they need not be simulated; effects of the vehicle are simulated. Only
// for vehicles with wings and motors: beat-averaged vehicles predict effects of sensors.
//
//   gyro_bias                   gyro - drift (1 - exp(-t / warm_up)), t since the log began; the drift's mean is kept
//   accelerometer_misalignment  specific force rotated back by a small rotation vector
//   vibration_rectification     specific force - gain (mean square about the mean over a beat), on every axis
//   mocap_tilt                  poses rotated back about x and y of W
//   marker_offset               measured point - R offset
//   mocap_delay                 poses earlier by the delay that the header does not declare
//
// Errors of declared sensors are undone likewise. They are no effects, as every laboratory has them and they are small:
//   imu_mounting                gyro and specific force rotated back by a small rotation vector
//   imu_place                   position of the IMU in B corrected
//   power_delay                 samples of power.csv earlier by the delay that the header does not declare
//   imu_clock, mocap_clock,     times scaled about the middle of the log, for a clock that runs fast by `rate`: at
//     power_clock               the ends of 10 s, a crystal's 50 ppm are 3 % of the period of the fourth harmonic
// On a bench, delays and clocks of the streams are not undone: to first order, rows of harmonic h turn (late_rows()).
//   forces_clock, forces_delay; wings_clock, wings_delay; power_clock, power_delay
#pragma once

#include <map>
#include <string>

#include "flightlog/flight_log.hpp"

namespace flappy::gap {

/// Parameter values by [effect or error of a sensor][parameter].
using EffectValues = std::map<std::string, std::map<std::string, double>>;
/// Those of `effects` that are effects of sensors.
EffectValues sensor_effects(const EffectValues& effects);

/// Returns `log` with the given effects and errors of sensors undone, in reverse of the order in which the sensor makes
/// them; other effects are ignored. std::out_of_range if one of them lacks a parameter.
flightlog::FlightLog without(const EffectValues& effects, flightlog::FlightLog log);

}  // namespace flappy::gap
