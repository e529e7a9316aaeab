// Gyro, attitude, accelerometer and position must agree within noise; wrong axes, units or clocks exceed it by far.
#include "flightlog/check/check_motion.hpp"

#include <algorithm>
#include <cmath>

#include "flightlog/readings.hpp"

namespace flappy::flightlog {
namespace {

/// Replaces the beat frequency without wings: windows of 0.2 s, in which a robot turns more than mocap drifts.
constexpr double kUnflapped_Hz = 5;

/// The motion without poses whose markers were swapped, where a second estimator can show that.
SensorMotion motion_of(const FlightLog& log) {
  if (!log.attitude) return SensorMotion(log);
  const std::vector<char> swapped = swapped_poses(log);
  FlightLog seen = log;
  MocapStream& m = seen.mocap;
  for (Column* column : {&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz}) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < swapped.size(); ++i)
      if (!swapped[i]) (*column)[kept++] = (*column)[i];
    column->resize(kept);
  }
  return m.t_s.size() < 2 ? SensorMotion(log) : SensorMotion(seen);
}

}  // namespace

void check_motion(const FlightLog& log, Findings& findings) {
  const FlightHeader& h = log.header;
  // Windows of whole beats, in which the beat averages out: about 50 ms, at least 2.5 intervals of mocap.
  const double per_s = h.flapping_Hz > 0 ? h.flapping_Hz : kUnflapped_Hz;
  const double window_s = std::max(std::round(0.05 * per_s), std::ceil(2.5 / h.mocap.rate_hz * per_s)) / per_s;
  Context c{log, findings, motion_of(log), {}, std::max(window_s, 1 / per_s), 0, 0, {}, {}};
  c.windows = make_windows(c.motion, c.window_s);
  double squares = 0;
  for (const BeatWindow& w : c.windows)
    squares += w.rate_rad_s[0].squaredNorm() / static_cast<double>(c.windows.size());
  // Noise of a window's rate: two attitudes; turning during the jitter of arrival times; interpolation between two
  // samples. The latter is a quarter of roughness_rad(), which also contains sqrt(1.5) times an attitude's noise.
  const auto jitter_of = [](const Column& t_s) {
    return t_s.empty() ? 0 : stream_statistics("", t_s, std::nullopt).jitter_s;
  };
  const double jitter_s = std::hypot(jitter_of(log.mocap.t_s), jitter_of(log.imu.t_s));
  const double noise = h.mocap.attitude_noise_rad, rough = c.motion.roughness_rad();
  const double missed = std::sqrt(std::max(rough * rough - 1.5 * noise * noise, 0.0)) / 4;
  c.rate_noise =
      std::max(std::hypot(std::numbers::sqrt2 * noise, jitter_s * std::sqrt(squares), missed) / c.window_s, 1e-4);
  c.gyro_noise = std::max(h.imu.gyro_noise_rad_s / std::sqrt(std::max(h.imu.rate_hz * c.window_s, 1.0)), 1e-5);
  if (!h.inputs.empty() && !check_frames(c)) {
    for (const char* name : {"gyro", "accelerometer"})
      c.add_finding(name, Verdict::not_tested, "needs an attitude that is understood");
    return;
  }
  if (log.imu.gyro_x_rad_s.empty()) c.add_finding("gyro", Verdict::not_tested, "there is none");
  else check_rotation(c);
  check_translation(c);
}

}  // namespace flappy::flightlog
