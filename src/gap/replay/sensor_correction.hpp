// Effects of sensors, taken back: what a log would have said, had they not been there. The vehicle's own effects are flown;
// these are undone, so that one prediction serves all of them.
//
//   gyro_bias                   gyro - drift (1 - exp(-t / warm_up)), t since the log began, less its mean
//   accelerometer_misalignment  force turned back by a small rotation vector
//   vibration_rectification     force - gain (mean square about the mean over a beat), on every axis
//   mocap_tilt                  world turned back about x and y
//   marker_offset               seen point - R offset
//   mocap_delay                 poses earlier by what the header does not say
//
// So are departures of laboratories from their headers, which no catalogue has, for they are small and everywhere:
//
//   imu_mounting                gyro and force turned back by a small rotation vector
//   imu_place                   the IMU sits elsewhere in B
//   power_delay                 currents earlier by what the header does not say
//   imu_clock, mocap_clock,     instants about the middle of the log, by a clock that runs so much too fast: a crystal's 50 ppm are 3 %
//     power_clock                 of the fourth harmonic's period at either end of 10 s
#pragma once

#include <map>
#include <string>

#include "flightlog/flight_log.hpp"

namespace flappy::gap {

using EffectValues = std::map<std::string, std::map<std::string, double>>;
/// The effects of sensors among `effects`.
EffectValues sensor_effects(const EffectValues& effects);

/// `log` without the given effects of sensors; others are ignored.
flightlog::FlightLog without(const EffectValues& effects, flightlog::FlightLog log);

}  // namespace flappy::gap
