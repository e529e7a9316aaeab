// The parts of check_motion(), and the context in which each leaves results for the next.
#pragma once

#include <numbers>

#include "flightlog/check/check_parts.hpp"
#include "flightlog/check/motion.hpp"

namespace flappy::flightlog {

using Values = std::vector<std::pair<std::string, double>>;

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr char kAxes[] = "xyz";

struct Context {
  const FlightLog& log;
  Findings& findings;
  SensorMotion motion;
  std::vector<BeatWindow> windows;
  double window_s;
  double rate_noise;  ///< sd of a window's mean rate from mocap, rad/s
  double gyro_noise;  ///< sd of a window's mean rate from the gyro, rad/s
  SensorFrame frame;  ///< the frame found; the declared one where it fits or none was found
  Lag lag;
  Matrix3d accel_axes = Matrix3d::Identity();  ///< axes found for the accelerometer: columns to body

  void add_finding(const std::string& check, Verdict verdict, const std::string& text, Values values = {},
                   LogPlace fault = {}) {
    findings.push_back({check, verdict, text, std::move(values), std::move(fault)});
  }
};

/// For declared inputs: compares attitude, accelerometer, positions and a second estimator; sets accel_axes. False
/// where the attitude's convention is not the declared one.
bool check_frames(Context& c);
/// Compares the gyro and its clock with the attitude; sets frame and lag.
void check_rotation(Context& c);
/// Compares accelerometer and position, using the attitude, frame and lag found before.
void check_translation(Context& c);

}  // namespace flappy::flightlog
