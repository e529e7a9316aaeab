// The parts of check_motion(), and what one finds out and the next needs.
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
  double rate_noise;  ///< rad/s, of a window's mean rate, from mocap
  double gyro_noise;  ///< rad/s, of a window's mean rate, from the gyro
  SensorFrame frame;  ///< as found; as declared where that fits or nothing was found
  Lag lag;
  Matrix3d accel_axes = Matrix3d::Identity();  ///< the accelerometer's, where they are others than declared

  void add_finding(const std::string& check, Verdict verdict, const std::string& text, Values values = {},
                   LogPlace fault = {}) {
    findings.push_back({check, verdict, text, std::move(values), std::move(fault)});
  }
};

/// Attitude, accelerometer, positions and a second estimator, where inputs are declared; leaves accel_axes. False where the attitude
/// was meant otherwise.
bool check_frames(Context& c);
/// Clock and gyro against the attitude; leaves frame and lag.
void check_rotation(Context& c);
/// Accelerometer and position, by the attitude as it was understood.
void check_translation(Context& c);

}  // namespace flappy::flightlog
