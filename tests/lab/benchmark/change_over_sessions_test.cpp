// Which effects count.
#include "lab/benchmark/change_over_sessions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "lab/benchmark/stub_family.hpp"

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

/// The circle, with what is added to every sample.
FlightLog shifted(double accel_z, double gyro_x = 0) {
  FlightLog log = circling();
  for (double& x : log.imu.accel_z_m_s2) x += accel_z;
  for (double& x : log.imu.gyro_x_rad_s) x += gyro_x;
  return log;
}

TEST(OverSessions, IsTheChangeOverTheirStandardDeviation) {
  // x_s = d_s sqrt(W): pairs differ by 0.6 (variance 0.18) and 0.2 (0.02); the mean of both is 0.1
  const auto others = [](const std::vector<FlightLog>& logs) {
    std::vector<OtherSession> sessions;
    for (const FlightLog& log : logs) sessions.push_back({0, windowed_channels(log)});
    return sessions;
  };
  const auto of = [&](double change) {
    return over_sessions({{shifted(change), shifted(0)}},
                         others({shifted(0.3), shifted(-0.3), shifted(0.1), shifted(-0.1)}));
  };
  EXPECT_NEAR(of(0.5).ratio, 0.5 / std::sqrt(0.1), 1e-6);
  EXPECT_TRUE(of(0.5).channel == "accel_z mean" || of(0.5).channel.starts_with("acceleration")) << of(0.5).channel;
  EXPECT_DOUBLE_EQ(of(0).ratio, 0);
  // what all sessions have alike hides nothing, as references have it, too; nor does what another channel has
  const OverSessions beside =
      over_sessions({{shifted(0, 0.5), shifted(0)}},
                    others({shifted(5, 0.11), shifted(-5, 0.09), shifted(-5, 0.11), shifted(5, 0.09)}));
  EXPECT_GE(beside.ratio, 0.5 / std::sqrt(2e-4) - 1e-3) << "by gyro_x; a turn less the gyro's shows it, too";
}

TEST(OverSessions, WeighsFlightsByTheirChange) {
  const FlightLog same = shifted(0);
  const auto pairs = [&](double first_flight) {
    std::vector<OtherSession> sessions;
    for (const auto& [flight, x] : {std::pair{0, first_flight}, {1, 0.3}, {1, 0.1}})
      for (const int sign : {1, -1})
        sessions.push_back({static_cast<std::size_t>(flight), windowed_channels(shifted(sign * x))});
    return sessions;
  };
  // the first flight has no change: it neither adds to the size, nor do sessions hide the change there
  EXPECT_NEAR(over_sessions({{same, same}, {shifted(0.5), same}}, pairs(7)).ratio, 0.5 / std::sqrt(0.1), 1e-6);
  // variances by pairs 0.08, 0.18 and 0.02
  EXPECT_NEAR(over_sessions({{shifted(1), same}, {shifted(2), same}}, pairs(0.2)).ratio,
              (1 + 4) / 3. / std::sqrt(0.28 / 3), 1e-6);
}

/// A robot whose sessions shift its accelerometer, and whose effect shifts it more; it crashes in one session.
class Shifting final : public StubFamily {
 public:
  Shifting() : StubFamily("x") {}
  blind::FamilyFlight fly(const blind::Assignment& a, std::size_t flight) const override {
    if (a.session == 12) return {true, "crashed", {}};
    EXPECT_EQ(a.programme_of.value_or(a.session), 1U) << "every flight has the programme of the tests";
    flown_.insert(a.session);
    double shift = static_cast<double>(a.session % 2 == 0 ? 1 : -1) * 0.1;
    for (const auto& [id, magnitude] : a.effects) shift += magnitude;
    return {false, "", shifted(shift + static_cast<double>(flight))};
  }
  mutable std::set<std::size_t> flown_;
};

TEST(ChangeOverSessions, FliesTheProgrammeOfTheTestsInOtherSessions) {
  const Shifting family;
  blind::Assignment robot;
  robot.session = 1;
  robot.effects = {{"wind", 0.5}, {"tether", 0.4}};
  const std::vector<OverSessions> found =
      change_over_sessions(family, robot, {family.fly(robot, 0).log, family.fly(robot, 1).log});
  // sessions 11, 13 to 17: -0.1, -0.1; 0.1, -0.1; 0.1, -0.1
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].ratio, 0.5 / std::sqrt((0 + 0.02 + 0.02) / 3), 1e-3);
  EXPECT_NEAR(found[1].ratio, 0.8 * found[0].ratio, 1e-3);
  EXPECT_EQ(family.flown_, (std::set<std::size_t>{1, 11, 13, 14, 15, 16, 17}));
  EXPECT_TRUE(change_over_sessions(family, robot, {family.fly(robot, 0).log}, 3).empty()) << "too few to say";
}

TEST(LargerOf, TakesWhatIsKnown) {
  const std::vector<OverSessions> in_flight = {{"rate", 4}, {"force", 1}}, on_bench = {{"stroke", 2}, {"current", 9}};
  const std::vector<OverSessions> both = larger_of(in_flight, on_bench);
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[0].channel, "rate");
  EXPECT_EQ(both[1].channel, "current");
  ASSERT_EQ(larger_of({}, on_bench).size(), 2U) << "the robot crashes in nearly all other sessions";
  EXPECT_EQ(larger_of({}, on_bench)[0].channel, "stroke");
  EXPECT_EQ(larger_of(in_flight, {})[1].channel, "force");
}

}  // namespace
}  // namespace flappy::benchmark
