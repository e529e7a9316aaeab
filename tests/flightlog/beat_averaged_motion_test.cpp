// Means over beats, against filters and motions that are known in closed form.
#include "flightlog/beat_averaged_motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "refusal.hpp"

namespace flappy::flightlog {
namespace {

using Eigen::Vector3d;
constexpr double kTurn = 2 * std::numbers::pi, kRate_Hz = 100, kBandwidth_Hz = 3;

TEST(LowPass, IsButterworthsOfOrderFourTwiceWithoutDelay) {
  // by the bilinear transform |H|^2 of both passes is 1 / (1 + (tan(pi f / rate) / tan(pi fc / rate))^8)
  for (const double f : {0.5, 2.0, 3.0, 4.0, 6.0}) {
    std::vector<double> x(2000);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(kTurn * f * static_cast<double>(i) / kRate_Hz);
    const std::vector<double> y = low_pass(x, kBandwidth_Hz / kRate_Hz);
    const double ratio = std::tan(kTurn / 2 * f / kRate_Hz) / std::tan(kTurn / 2 * kBandwidth_Hz / kRate_Hz);
    const double gain = 1 / (1 + std::pow(ratio, 8));
    for (std::size_t i = 500; i < 1500; ++i) EXPECT_NEAR(y[i], gain * x[i], 1e-6) << f << " Hz";
  }
}

TEST(LowPass, KeepsALineToItsEnds) {
  std::vector<double> x(300);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 2 + 0.1 * static_cast<double>(i);
  const std::vector<double> y = low_pass(x, 0.03);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(y[i], x[i], 1e-3) << i;
}

/// Rolls and yaws along a curve: slow against the bandwidth, of which a hundredth of a thousandth is lost.
struct Truth {
  Vector3d position, velocity, acceleration, rate;
  Eigen::Matrix3d attitude;
};
Truth truth(double t) {
  const double a = kTurn * 0.3, b = kTurn * 0.4;
  Truth x;
  x.position = {std::sin(a * t), std::cos(b * t), 1 + 0.2 * std::sin(b * t)};
  x.velocity = {a * std::cos(a * t), -b * std::sin(b * t), 0.2 * b * std::cos(b * t)};
  x.acceleration = {-a * a * std::sin(a * t), -b * b * std::cos(b * t), -0.2 * b * b * std::sin(b * t)};
  const double yaw = 0.4 * std::sin(a * t), yaw_rate = 0.4 * a * std::cos(a * t);
  const double roll = 0.3 * std::sin(b * t), roll_rate = 0.3 * b * std::cos(b * t);
  x.attitude =
      (Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(roll, Vector3d::UnitX())).toRotationMatrix();
  x.rate = {roll_rate, yaw_rate * std::sin(roll), yaw_rate * std::cos(roll)};
  return x;
}

FlightLog flight(double seconds) {
  FlightLog log;
  log.header.inputs = {"u"};
  log.header.mocap = {kRate_Hz, 0, 1e-4, 1e-3};
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, 1e-6);
  for (int i = 0; i <= static_cast<int>(seconds * kRate_Hz); ++i) {
    const double t = i / kRate_Hz;
    const Truth x = truth(t);
    const Eigen::Quaterniond q(x.attitude);
    MocapStream& m = log.mocap;
    m.t_s.push_back(t);
    m.x_m.push_back(x.position.x() + normal(random));
    m.y_m.push_back(x.position.y());
    m.z_m.push_back(x.position.z());
    m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
  }
  return log;
}

/// `rough`: how far forces may be off, as where poses were filled in.
void expect_true(const BeatAveragedMotion& m, double rough) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (!m.seen[i]) continue;
    ++seen;
    const Truth x = truth(m.t_s(i));
    const Vector3d force = x.attitude.transpose() * (x.acceleration + Vector3d(0, 0, 9.81));
    ASSERT_LT((m.position_m[i] - x.position).norm(), 1e-3) << m.t_s(i);
    ASSERT_LT((m.velocity_B_m_s[i] - x.attitude.transpose() * x.velocity).norm(), 2e-2 + rough / 10) << m.t_s(i);
    ASSERT_LT((m.force_m_s2[i] - force).norm(), 2e-2 + rough) << m.t_s(i);
    ASSERT_LT((m.rate_rad_s[i] - x.rate).norm(), 1e-2 + rough / 10) << m.t_s(i);
  }
  EXPECT_GT(seen, m.size() / 2);
}

TEST(BeatAveragedMotion, IsThatOfTheFlight) {
  expect_true(beat_averaged_motion(flight(20), kBandwidth_Hz, "flight"), 0);
}

TEST(BeatAveragedMotion, OfPosesThatAreAnothers) {
  // 13 poses whose markers were taken for others: too many for a leap, and known by the second estimator alone
  FlightLog log = flight(20);
  log.attitude.emplace();
  log.header.attitude = {kRate_Hz, 0, 0.01};
  const MocapStream own = log.mocap;
  log.attitude->t_s = own.t_s;
  log.attitude->qw = own.qw, log.attitude->qx = own.qx, log.attitude->qy = own.qy, log.attitude->qz = own.qz;
  for (std::size_t i = 900; i < 913; ++i)
    log.mocap.qw[i] = 0, log.mocap.qx[i] = 0, log.mocap.qy[i] = 0, log.mocap.qz[i] = 1;
  expect_true(beat_averaged_motion(log, kBandwidth_Hz, "flight"), 0.3);
}

TEST(BeatAveragedMotion, LeavesOutItsEnds) {
  for (int samples = 2990; samples < 3000; ++samples) {  // of some, steps add up to more than the last pose's time
    const BeatAveragedMotion m = beat_averaged_motion(flight((samples + 0.5) / kRate_Hz), kBandwidth_Hz, "flight");
    for (const std::size_t i : {std::size_t{0}, m.size() - 1}) EXPECT_EQ(m.seen[i], 0) << i << " of " << samples;
  }
}

TEST(BeatAveragedMotion, LeavesOutWhatWasNotSeen) {
  FlightLog log = flight(20);
  for (flightlog::Column* c : {&log.mocap.t_s, &log.mocap.x_m, &log.mocap.y_m, &log.mocap.z_m, &log.mocap.qw,
                               &log.mocap.qx, &log.mocap.qy, &log.mocap.qz})
    c->erase(c->begin() + 900, c->begin() + 1000);
  const BeatAveragedMotion m = beat_averaged_motion(log, kBandwidth_Hz, "flight");
  for (std::size_t i = 0; i < m.size(); ++i)
    if (m.t_s(i) > 8.3 && m.t_s(i) < 10.7) EXPECT_EQ(m.seen[i], 0) << m.t_s(i);
  expect_true(m, 0.05);  // what a straight line made of the gap reaches a little way through the filter
}

TEST(BeatAveragedMotion, LeavesOutWhatTheGyroMissed) {
  FlightLog log = flight(20);
  log.header.imu.bandwidth_hz = 1e6;  // no delay to speak of
  ImuStream& u = log.imu;
  for (int i = 400; i < 1700; ++i) {  // 4 s to 17 s, nothing from 9 s to 10 s
    if (i >= 900 && i < 1000) continue;
    const Truth x = truth(i / 100.0);
    u.t_s.push_back(i / 100.0);
    u.gyro_x_rad_s.push_back(x.rate.x()), u.gyro_y_rad_s.push_back(x.rate.y()), u.gyro_z_rad_s.push_back(x.rate.z());
    for (Column* c : {&u.accel_x_m_s2, &u.accel_y_m_s2, &u.accel_z_m_s2}) c->push_back(0);
  }
  const BeatAveragedMotion m = beat_averaged_motion(log, kBandwidth_Hz, "flight");
  const std::ptrdiff_t unseen = std::ranges::count(m.seen, 0);
  for (std::size_t i = 0; i < m.size(); ++i)
    if (const double t = m.t_s(i); t < 4 || (t > 8.99 && t < 10) || t > 17) EXPECT_EQ(m.seen[i], 0) << t;
  // 4 + 1 + 3 s, and four times 2.5 periods of the bandwidth beside them
  EXPECT_NEAR(static_cast<double>(unseen) * m.step_s, 8 + 4 * 2.5 / kBandwidth_Hz, 0.1);
}

// A low-pass of 20 Hz is late by T = 8 ms. Of the fastest motion, w = 2 pi 0.8 rad/s and 1.1 rad/s, it leaves an error of
// (w T)^2 / 2, 1e-3 rad/s; a gyro that is not moved has one of w T, 0.04 rad/s.
TEST(BeatAveragedMotion, MovesTheGyroByTheDelayOfItsFilter) {
  FlightLog log = flight(20);
  log.header.imu = {.rate_hz = 1000, .latency_s = 0.01, .bandwidth_hz = 20};
  const double kept = std::exp(-kTurn * log.header.imu.bandwidth_hz / 1000);
  ImuStream& u = log.imu;
  Vector3d low = truth(0).rate;
  for (int i = 0; i < 20000; ++i) {
    low = kept * low + (1 - kept) * truth((i + 0.5) / 1000.0).rate;
    u.t_s.push_back((i + 1) / 1000.0 + 0.01);
    u.gyro_x_rad_s.push_back(low.x()), u.gyro_y_rad_s.push_back(low.y()), u.gyro_z_rad_s.push_back(low.z());
    for (Column* c : {&u.accel_x_m_s2, &u.accel_y_m_s2, &u.accel_z_m_s2}) c->push_back(0);
  }
  expect_true(beat_averaged_motion(log, kBandwidth_Hz, "flight"), 0);
}

TEST(BeatAveragedMotion, RefusesWhatIsTooShortOrTooSlow) {
  EXPECT_EQ(test::refusal([] { beat_averaged_motion(flight(2), kBandwidth_Hz, "flight"); }),
            "flight/mocap.csv: is too short for means over beats; accepted: 3 s or more of motion capture");
  FlightLog slow = flight(20);
  slow.header.mocap.rate_hz = 10;
  EXPECT_EQ(test::refusal([&] { beat_averaged_motion(slow, kBandwidth_Hz, "flight"); }),
            "flight/flight.toml: mocap.rate_hz: 10 is too slow to see motion up to the vehicle's beat.bandwidth_Hz; "
            "accepted: 12 or more");
}

}  // namespace
}  // namespace flappy::flightlog
