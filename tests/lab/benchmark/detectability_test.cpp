// How large effects have to be.
#include "lab/benchmark/detectability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace flappy::benchmark {
using namespace blind;
namespace {

/// 1,000 beats of a robot that hovers: its weight, and a first harmonic of 10 sqrt 2 m/s^2 along x, so that the three forces have a
/// waveform of sqrt((96.04 + 100)/3) = 8.084 m/s^2.
Changed hovering() {
  Changed c;
  c.flapping_Hz = 34;
  c.change.resize(1000);
  c.signal.resize(1000);
  for (auto& s : c.signal) s[1] = 10 * std::numbers::sqrt2, s[10] = 9.8;
  return c;
}

TEST(FamilyDetectability, MeasuresByTheWeightAndTheWaveform) {
  // up and down from beat to beat, which nothing takes over
  Changed c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) c.change[b][10] = b % 2 == 0 ? 0.49 : -0.49;
  Shown s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.05, 1e-9);
  EXPECT_EQ(s.channel, 2U);
  EXPECT_EQ(s.order, 0U);
  EXPECT_NEAR(detectable_magnitude(c, 2), kShare / 0.05, 1e-6);
  EXPECT_EQ(detectable_magnitude(c, 0.2), std::numeric_limits<double>::infinity());
  // in y, which has no signal of its own, a harmonic is measured by the waveform: (0.4^2 + 0.3^2)/2 has the root 0.35355
  c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) {
    c.change[b][5 + 3] = b % 2 == 0 ? 0.4 : -0.4;
    c.change[b][5 + 4] = b % 2 == 0 ? 0.3 : -0.3;
  }
  s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.35355 / 8.0838, 1e-4);
  EXPECT_EQ(s.channel, 1U);
  EXPECT_EQ(s.order, 2U);
  // a tenth of the beats is enough
  for (std::size_t b = 100; b < c.change.size(); ++b) c.change[b].fill(0);
  EXPECT_NEAR(shown(c, 1).share, s.share, 1e-4);
  EXPECT_EQ(shown(hovering(), 1).share, 0);
  EXPECT_EQ(shown({}, 1).share, 0);
}

TEST(FamilyDetectability, LeavesToFiguresAndLatenessWhatTheyTakeOver) {
  // 8 % more of the wing beat, 0.4 ms late, and a push of 2 % of the weight: all is taken over, of twice as much is not
  Changed c = hovering();
  const double late = 4e-4 * 2 * std::numbers::pi * 34 * 10 * std::numbers::sqrt2;
  for (auto& d : c.change) d[1] = 0.08 * 10 * std::numbers::sqrt2, d[2] = -late, d[10] = 0.02 * 9.8;
  EXPECT_LT(shown(c, 1).share, 1e-6);
  EXPECT_GT(shown(c, 4).share, kShare);
}

TEST(FamilyDetectability, ReadsBeatsFromTheImu) {
  flightlog::FlightLog log;
  log.header.flapping_Hz = 34;
  log.header.imu.latency_s = 2e-3;
  const double w = 2 * std::numbers::pi * 34;
  for (int i = 0; i < 1000; ++i) {
    const double t = 1e-3 * i;
    log.imu.t_s.push_back(t + 2e-3);
    for (flightlog::Column* k :
         {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.gyro_x_rad_s, &log.imu.gyro_y_rad_s})
      k->push_back(0);
    log.imu.accel_z_m_s2.push_back(9.8 + 3 * std::cos(w * t) - 2 * std::sin(2 * w * t));
    log.imu.gyro_z_rad_s.push_back(0.5 * t + 0.1 * std::sin(w * t));
  }
  const Beats beats = beats_of(log, {0, 10 / 34.0, 5});
  ASSERT_TRUE(beats[1]);
  EXPECT_FALSE(beats[2]) << "after the end";
  const auto& b = *beats[1];
  for (const auto& [at, value] :
       {std::pair{10, 9.8}, {11, 3.0}, {12, 0.0}, {13, 0.0}, {14, -2.0}, {25, 0.5}, {26, 0.1 * w}, {27, 0.0}})
    EXPECT_NEAR(b[static_cast<std::size_t>(at)], value, 1e-6) << at;
}

}  // namespace
}  // namespace flappy::benchmark
