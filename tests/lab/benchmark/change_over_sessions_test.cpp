// Which effects count.
#include "lab/benchmark/change_over_sessions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flappy::benchmark {
namespace {

using flightlog::FlightLog;

/// 4 s on a circle of radius 0.3 m at 2 rad/s, level, heading along the path: motion capture and IMU agree.
FlightLog circling() {
  constexpr double kRadius_m = 0.3, kRate_rad_s = 2;
  FlightLog log;
  log.header.flapping_Hz = 34;
  log.header.mocap = {200, 0.013, 0, 0, flightlog::PoseSource::motion_capture};
  log.header.imu.rate_hz = 1000, log.header.imu.latency_s = 0.002;
  for (int i = 0; i <= 4000; ++i) {
    const double t = 1e-3 * i;
    log.command.t_s.push_back(t);
    log.imu.t_s.push_back(t + log.header.imu.latency_s);
    log.imu.gyro_x_rad_s.push_back(0), log.imu.gyro_y_rad_s.push_back(0), log.imu.gyro_z_rad_s.push_back(kRate_rad_s);
    log.imu.accel_x_m_s2.push_back(0), log.imu.accel_y_m_s2.push_back(kRadius_m * kRate_rad_s * kRate_rad_s);
    log.imu.accel_z_m_s2.push_back(log.header.gravity_m_s2);
    if (i % 5 != 0) continue;
    const double a = kRate_rad_s * t, heading = a + std::numbers::pi / 2;
    log.mocap.t_s.push_back(t + log.header.mocap.latency_s);
    log.mocap.x_m.push_back(kRadius_m * std::cos(a)), log.mocap.y_m.push_back(kRadius_m * std::sin(a));
    log.mocap.z_m.push_back(1);
    log.mocap.qw.push_back(std::cos(heading / 2)), log.mocap.qx.push_back(0), log.mocap.qy.push_back(0);
    log.mocap.qz.push_back(std::sin(heading / 2));
  }
  return log;
}

double largest(const std::vector<WindowedChannel>& channels, const std::string& name) {
  for (const WindowedChannel& c : channels)
    if (c.name == name) {
      double most = 0;
      std::size_t known = 0;
      for (const double x : c.values)
        if (std::isfinite(x)) most = std::max(most, std::abs(x)), ++known;
      EXPECT_GT(known, c.values.size() / 2) << name;
      return most;
    }
  ADD_FAILURE() << "no channel " << name;
  return 0;
}

TEST(WindowedChannels, MotionCaptureAndImuAgreeOnACircle) {
  FlightLog log = circling();
  const auto of = [&](const char* name) { return largest(windowed_channels(log), name); };
  EXPECT_LT(of("turn less the gyro's z"), 1e-3);
  // a window has 29 or 30 samples, so its mean is up to 0.15 mm beside that over its time
  EXPECT_LT(of("acceleration less the accelerometer's x"), 8e-3);
  EXPECT_LT(of("acceleration less the accelerometer's y"), 8e-3);
  for (double& f : log.imu.accel_z_m_s2) f += 0.05;
  EXPECT_NEAR(of("acceleration less the accelerometer's z"), 0.05, 1e-9);
  // a gyro that is 0.1 rad/s off, over a window of 5 beats
  log = circling();
  for (double& x : log.imu.gyro_y_rad_s) x += 0.1;
  EXPECT_NEAR(of("turn less the gyro's y"), 0.1 * 5 / 34, 1e-3);
}

TEST(OverSessions, IsTheChangeOverTheirStandardDeviation) {
  const FlightLog before = circling();
  const auto shifted = [&](double accel_z, double gyro_x) {
    FlightLog log = before;
    for (double& x : log.imu.accel_z_m_s2) x += accel_z;
    for (double& x : log.imu.gyro_x_rad_s) x += gyro_x;
    return log;
  };
  // <e, d_s> / |e| = d_s sqrt(W): 0.5 / sqrt((0.3^2 + 0.1^2) / 4)
  const OverSessions seen = over_sessions({{shifted(0.5, 0), before}}, {{shifted(0.3, 0)}, {shifted(-0.1, 0)}});
  EXPECT_NEAR(seen.ratio, 0.5 / std::sqrt((0.09 + 0.01) / 4), 1e-6);
  EXPECT_TRUE(seen.channel == "accel_z mean" || seen.channel.starts_with("acceleration")) << seen.channel;
  // what sessions change in another channel hides nothing, and no change is none
  const OverSessions beside = over_sessions({{shifted(0, 0.5), before}}, {{shifted(5, 0.01)}, {shifted(-5, 0.01)}});
  EXPECT_GT(beside.ratio, 50);
  EXPECT_DOUBLE_EQ(over_sessions({{before, before}}, {{shifted(0.3, 0)}}).ratio, 0);
}

}  // namespace
}  // namespace flappy::benchmark
