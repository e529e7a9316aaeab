#include "gap/replay/sensor_correction.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "gap/flown_flights.hpp"

namespace flappy::gap::sensor_correction_test {
namespace {

using Eigen::Index;

TEST(SensorEffects, AreTakenBack) {
  const Flights flights = flown("hummingbird_nominal");
  const flightlog::FlightLog& log = flights[0]->recording()->log;
  const auto mean_path = [](const PredictedFlight& f) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0;
    for (std::size_t j = 0; j < f.beats(); ++j)
      if (f.covers(j, kPathX)) {
        for (std::size_t i = 0; i < 3; ++i)
          sum[static_cast<Index>(i)] += f.measured()[j * kRowsPerBeat + (kPathX + i) * kCoefficients];
        n += 1;
      }
    return Eigen::Vector3d(sum / n);
  };
  // a world that leans by e sees gravity lean: its path bends by -g e x z beyond what the accelerometer says
  const double e = 0.02, g = 9.81;
  const auto tilted = flights[0]->with_log(without({{"mocap_tilt", {{"x_rad", -e}, {"y_rad", 0}}}}, log));
  const Eigen::Vector3d bend = mean_path(*tilted) - mean_path(*flights[0]);
  EXPECT_NEAR(bend.y(), g * e, 0.05 * g * e);
  EXPECT_NEAR(bend.x(), 0, 0.05 * g * e);
  // and comes back
  const flightlog::FlightLog back = without({{"mocap_tilt", {{"x_rad", e}, {"y_rad", 0}}}}, tilted->recording()->log);
  EXPECT_NEAR(back.mocap.y_m[100], log.mocap.y_m[100], 1e-12);
  // an offset moves the point, a delay the clock
  const auto moved = without({{"marker_offset", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}}, log);
  EXPECT_NEAR(std::hypot(moved.mocap.x_m[100] - log.mocap.x_m[100], moved.mocap.y_m[100] - log.mocap.y_m[100],
                         moved.mocap.z_m[100] - log.mocap.z_m[100]),
              0.01, 1e-12);
  EXPECT_EQ(without({{"mocap_delay", {{"delay_s", 0.004}}}}, log).header.mocap.latency_s,
            log.header.mocap.latency_s + 0.004);
  // a turned accelerometer keeps its length
  const auto turned = without({{"accelerometer_misalignment", {{"x_rad", 0.1}, {"y_rad", 0}, {"z_rad", 0}}}}, log);
  EXPECT_NEAR(turned.imu.accel_x_m_s2[50], log.imu.accel_x_m_s2[50], 1e-12);
  EXPECT_NEAR(turned.imu.accel_y_m_s2[50],
              std::cos(0.1) * log.imu.accel_y_m_s2[50] + std::sin(0.1) * log.imu.accel_z_m_s2[50], 1e-12);
  // a shaking of amplitude A rectifies to gain A^2 / 2; over 14 of 14.7 samples of a beat to 1 %
  flightlog::FlightLog shaking = log;
  flightlog::Column& x = shaking.imu.accel_x_m_s2;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = 3 + 10 * std::sin(2 * std::numbers::pi * 34 * (shaking.imu.t_s[i] - shaking.imu.t_s[0]));
  const auto mean = [](const flightlog::Column& c) {
    return std::accumulate(c.begin() + 100, c.end() - 100, 0.0) / static_cast<double>(c.size() - 200);
  };
  const auto calmed = without({{"vibration_rectification", {{"gain_s2_m", 1e-3}}}}, shaking);
  EXPECT_NEAR(mean(x) - mean(calmed.imu.accel_x_m_s2), 1e-3 * 100 / 2, 0.01 * 0.05);
  EXPECT_EQ(without({{"vibration_rectification", {{"gain_s2_m", 0}}}}, shaking).imu, shaking.imu);
  // how laboratories depart from their headers
  const auto mounted = without({{"imu_mounting", {{"x_rad", 0.1}, {"y_rad", 0}, {"z_rad", 0}}}}, log);
  EXPECT_NEAR(mounted.imu.gyro_y_rad_s[50],
              std::cos(0.1) * log.imu.gyro_y_rad_s[50] + std::sin(0.1) * log.imu.gyro_z_rad_s[50], 1e-12);
  EXPECT_NEAR(mounted.imu.accel_y_m_s2[50], turned.imu.accel_y_m_s2[50], 1e-12);
  EXPECT_EQ(without({{"imu_place", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}}, log).header.imu.position_m[0],
            log.header.imu.position_m[0] + 0.01);
  // a clock that runs fast is right in the middle, and beats stay where they were
  const auto slowed = without({{"imu_clock", {{"rate", 1e-4}}}}, log);
  EXPECT_NEAR(log.imu.t_s.back() - slowed.imu.t_s.back(), 0.5e-4 * (log.imu.t_s.back() - log.imu.t_s.front()), 1e-12);
  EXPECT_NEAR(slowed.imu.t_s.back() + slowed.imu.t_s.front(), log.imu.t_s.back() + log.imu.t_s.front(), 1e-9);
  EXPECT_EQ(slowed.mocap, log.mocap);
  EXPECT_EQ(flights[0]->with_log(slowed)->beats(), flights[0]->beats());
  EXPECT_TRUE(sensor_effects({{"wind", {}}, {"mocap_tilt", {}}}).count("mocap_tilt"));
  EXPECT_FALSE(sensor_effects({{"wind", {}}, {"mocap_tilt", {}}}).count("wind"));
}

}  // namespace
}  // namespace flappy::gap::sensor_correction_test
