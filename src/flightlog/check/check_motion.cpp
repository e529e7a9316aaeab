// Gyro, attitude, accelerometer and position against one another: they saw one motion, so what one says of it the others
// must. Noise is as declared; a mistake of axes, units or clocks is much larger.
#include "flightlog/check/check_motion.hpp"

#include <algorithm>
#include <cmath>

namespace flappy::flightlog {

void check_motion(const FlightLog& log, Findings& findings) {
  const FlightHeader& h = log.header;
  // Whole beats, in which what the beat shakes averages out; about 50 ms, and two samples of mocap or more.
  const double window_s =
      std::max(std::round(0.05 * h.flapping_Hz), std::ceil(2.5 / h.mocap.rate_hz * h.flapping_Hz)) / h.flapping_Hz;
  Context c{log, findings, SensorMotion(log), {}, std::max(window_s, 1 / h.flapping_Hz), 0, 0, {}, {}};
  c.windows = make_windows(c.motion, c.window_s);
  double squares = 0;
  for (const BeatWindow& w : c.windows)
    squares += w.rate_rad_s[0].squaredNorm() / static_cast<double>(c.windows.size());
  // Two attitudes a window apart; how far the body turns while arrival times jitter; and what interpolation between two
  // samples misses, a quarter of what it misses across a third one, noise sqrt(1.5) of one taken off.
  const double jitter_s = std::hypot(stream_statistics("", log.mocap.t_s, std::nullopt).jitter_s,
                                     stream_statistics("", log.imu.t_s, std::nullopt).jitter_s);
  const double noise = h.mocap.attitude_noise_rad, rough = c.motion.roughness_rad();
  const double missed = std::sqrt(std::max(rough * rough - 1.5 * noise * noise, 0.0)) / 4;
  c.rate_noise =
      std::max(std::hypot(std::numbers::sqrt2 * noise, jitter_s * std::sqrt(squares), missed) / c.window_s, 1e-4);
  c.gyro_noise = std::max(h.imu.gyro_noise_rad_s / std::sqrt(std::max(h.imu.rate_hz * c.window_s, 1.0)), 1e-5);
  check_rotation(c);
  check_translation(c);
}

}  // namespace flappy::flightlog
