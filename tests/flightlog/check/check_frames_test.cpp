#include <gtest/gtest.h>

#include <functional>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_faults.hpp"
#include "flightlog/check/inputs_log.hpp"
#include "flightlog/readings.hpp"

namespace flappy::flightlog {
namespace {

using Change = std::function<void(FlightLog&)>;

/// "check: text" of every warning.
std::vector<std::string> warnings(const CheckReport& report) {
  std::vector<std::string> list;
  for (const Finding& f : report.findings)
    if (f.verdict == Verdict::warning) list.push_back(f.check + ": " + f.text);
  return list;
}

std::string verdict_of(const CheckReport& report, const std::string& check) {
  for (const Finding& f : report.findings)
    if (f.check == check)
      return f.verdict == Verdict::ok ? "ok" : f.verdict == Verdict::warning ? "warning" : "not tested: " + f.text;
  return "absent";
}

/// Mocap's attitudes, changed as angles.
Change angles(const std::function<void(double& roll, double& pitch, double& yaw)>& change) {
  return [change](FlightLog& log) {
    MocapStream& m = log.mocap;
    for (std::size_t i = 0; i < m.t_s.size(); ++i) {
      const Eigen::Matrix3d r = Eigen::Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i]).toRotationMatrix();
      double roll = std::atan2(r(2, 1), r(2, 2)), pitch = -std::asin(r(2, 0)), yaw = std::atan2(r(1, 0), r(0, 0));
      change(roll, pitch, yaw);
      const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
      m.qw[i] = q.w(), m.qx[i] = q.x(), m.qy[i] = q.y(), m.qz[i] = q.z();
    }
  };
}

TEST(CheckFrames, FindNothingInGoodLogs) {
  const CheckReport report = check_flight(inputs_log());
  EXPECT_EQ(warnings(report), std::vector<std::string>());
  for (const char* check : {"axes", "attitude", "markers", "mocap frozen", "imu frozen", "attitude frozen",
                            "accelerometer", "speed", "upright", "input motor", "input servo", "battery"})
    EXPECT_EQ(verdict_of(report, check), "ok") << check;
  EXPECT_EQ(verdict_of(report, "gyro"), "not tested: there is none");
  EXPECT_TRUE(data_faults(inputs_log(), "log").empty());

  FlightLog bare = inputs_log();
  bare.header.imu = {}, bare.imu = {};
  bare.header.attitude.reset(), bare.attitude.reset();
  bare.header.power.reset(), bare.power.reset();
  bare.header.flapping_Hz = 0;
  const CheckReport less = check_flight(bare);
  EXPECT_EQ(warnings(less), std::vector<std::string>());
  EXPECT_EQ(verdict_of(less, "axes"), "not tested: there is no imu.csv");
  EXPECT_EQ(verdict_of(less, "accelerometer"), "not tested: there is no imu.csv");
  EXPECT_EQ(verdict_of(less, "attitude"), "absent");
  EXPECT_TRUE(data_faults(bare, "log").empty());
}

TEST(CheckFrames, JudgeAGyroWhereThereIsOne) {
  FlightLog log = inputs_log(), with_gyro = synthetic_log({.duration_s = 12, .rotation = 2});
  log.header.imu = with_gyro.header.imu, log.imu = with_gyro.imu;
  log.header.flapping_Hz = 0;  // windows need no beat
  EXPECT_EQ(warnings(check_flight(log)), std::vector<std::string>());
  EXPECT_EQ(verdict_of(check_flight(log), "gyro y"), "ok");
  std::swap(log.imu.gyro_x_rad_s, log.imu.gyro_y_rad_s);
  EXPECT_EQ(verdict_of(check_flight(log), "gyro"), "warning");
}

TEST(CheckFrames, NameWhatWasMeantOtherwise) {
  struct Mistake {
    std::string check, text, file;
    Change change;
  };
  const auto scaled = [](double x, double y, double z) {
    return [=](FlightLog& log) {
      for (double& v : log.imu.accel_x_m_s2) v *= x;
      for (double& v : log.imu.accel_y_m_s2) v *= y;
      for (double& v : log.imu.accel_z_m_s2) v *= z;
    };
  };
  constexpr double kDegree = std::numbers::pi / 180;
  const std::vector<Mistake> mistakes = {
      {"axes", "once turned: pitch is inverted", "mocap.csv",
       angles([](double&, double& pitch, double&) { pitch *= -1; })},
      {"axes", "once turned: roll is inverted", "mocap.csv",
       angles([](double& roll, double&, double&) { roll *= -1; })},
      {"axes", "once turned: roll and pitch are swapped", "mocap.csv",
       angles([](double& roll, double& pitch, double&) { std::swap(roll, pitch); })},
      {"axes", "radians taken for degrees", "mocap.csv",
       angles([](double& roll, double& pitch, double& yaw) { roll *= kDegree, pitch *= kDegree, yaw *= kDegree; })},
      {"axes", "the quaternion order is x, y, z, w", "mocap.csv",
       [](FlightLog& log) {
         MocapStream& m = log.mocap;
         const Column w = m.qw;
         m.qw = m.qx, m.qx = m.qy, m.qy = m.qz, m.qz = w;
       }},
      {"axes", "accel_x is the body's +y, accel_y is the body's +x", "imu.csv",
       [](FlightLog& log) { std::swap(log.imu.accel_x_m_s2, log.imu.accel_y_m_s2); }},
      {"axes", "accel_x is the body's +x, accel_y is the body's -y", "imu.csv", scaled(1, -1, 1)},
      {"accelerometer", "likely in g, not m/s^2", "imu.csv", scaled(1 / 9.81, 1 / 9.81, 1 / 9.81)},
      {"accelerometer", "the sign is flipped", "imu.csv", scaled(-1, -1, -1)},
      {"accelerometer", "it points along +x in B", "imu.csv",
       [](FlightLog& log) { std::swap(log.imu.accel_x_m_s2, log.imu.accel_z_m_s2); }},
  };
  for (const Mistake& m : mistakes) {
    FlightLog log = inputs_log();
    m.change(log);
    const CheckReport report = check_flight(log);
    bool found = false;
    for (const std::string& w : warnings(report)) found |= w.starts_with(m.check + ": ") && w.find(m.text) != w.npos;
    EXPECT_TRUE(found) << m.text << "\n" << testing::PrintToString(warnings(report));
    const std::vector<DataFault> faults = data_faults(log, report, "log");
    ASSERT_EQ(faults.size(), 1u) << m.text;
    EXPECT_EQ(faults[0].file, "log/" + m.file) << m.text;
  }
}

/// In g and turned: the one does not hide the other.
TEST(CheckFrames, NameTwoMistakesAtOnce) {
  FlightLog log = inputs_log();
  for (Column* c : {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.accel_z_m_s2})
    for (double& v : *c) v /= 9.81;
  std::swap(log.imu.accel_x_m_s2, log.imu.accel_y_m_s2);
  const CheckReport report = check_flight(log);
  EXPECT_EQ(verdict_of(report, "axes"), "warning");
  EXPECT_EQ(verdict_of(report, "accelerometer"), "warning");
}

/// Whose attitude is wrong the accelerometer says; without one, only that they differ.
TEST(CheckFrames, TellTwoEstimatorsApart) {
  FlightLog log = inputs_log();
  log.header.imu = {}, log.imu = {};
  angles([](double&, double& pitch, double&) { pitch *= -1; })(log);
  const CheckReport report = check_flight(log);
  ASSERT_EQ(warnings(report).size(), 1u);
  EXPECT_TRUE(warnings(report)[0].ends_with("in one of them, pitch is inverted")) << warnings(report)[0];
  EXPECT_EQ(verdict_of(report, "markers"), "not tested: needs attitudes that are understood");
  EXPECT_TRUE(data_faults(log, report, "log").empty());

  FlightLog other = inputs_log();
  AttitudeStream& a = *other.attitude;
  for (Column* c : {&a.qx, &a.qy, &a.qz})
    for (double& v : *c) v *= -1;
  const CheckReport inverse = check_flight(other);
  ASSERT_EQ(warnings(inverse).size(), 1u);
  EXPECT_NE(warnings(inverse)[0].find("in attitude.csv, the quaternion is inverse"), std::string::npos)
      << warnings(inverse)[0];
}

TEST(CheckFrames, SayWhatTooLittleTiltCannotTell) {
  FlightLog log = inputs_log({.duration_s = 12, .rotation = 0.02, .translation = 0.05});
  angles([](double&, double& pitch, double&) { pitch *= -1; })(log);
  const CheckReport report = check_flight(log);
  EXPECT_EQ(warnings(report), std::vector<std::string>());
  EXPECT_EQ(verdict_of(report, "axes"), "not tested: too little tilt to tell an inverted pitch");
}

TEST(CheckFrames, CountSwappedMarkers) {
  const auto swapped = [](std::size_t every, std::size_t length) {
    FlightLog log = inputs_log();
    MocapStream& m = log.mocap;
    const Eigen::Quaterniond other(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 1, 0).normalized()));
    std::size_t count = 0;
    for (std::size_t i = 100; i + length + 10 < m.t_s.size(); i += every)
      for (std::size_t k = i; k < i + length; ++k, ++count) {
        const Eigen::Quaterniond q = Eigen::Quaterniond(m.qw[k], m.qx[k], m.qy[k], m.qz[k]) * other;
        m.qw[k] = q.w(), m.qx[k] = q.x(), m.qy[k] = q.y(), m.qz[k] = q.z();
      }
    return std::pair(log, count);
  };
  const auto [some, count] = swapped(600, 40);
  const std::vector<char> rows = swapped_poses(some);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(rows, 1)), count);
  EXPECT_TRUE(!rows[99] && rows[100] && rows[139] && !rows[140]);
  const std::vector<std::string> seen = warnings(check_flight(some));
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_TRUE(seen[0].starts_with("markers: 160 of 2400 poses (6.7 %), up to 40 in a row")) << seen[0];
  EXPECT_TRUE(data_faults(some, "log").empty());
  const std::vector<DataFault> faults = data_faults(swapped(100, 30).first, "log");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].file, "log/mocap.csv");
  EXPECT_EQ(faults[0].line, 102u);
}

TEST(CheckFrames, CountFrozenSamples) {
  FlightLog log = inputs_log();
  for (Column* c : {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.accel_z_m_s2})
    for (std::size_t i = 1001; i < 1006; ++i) (*c)[i] = (*c)[1000];
  const std::vector<std::string> seen = warnings(check_flight(log));
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_TRUE(seen[0].starts_with("imu frozen: 5 of 6000 samples repeat the one before, up to 5 in a row")) << seen[0];
}

}  // namespace
}  // namespace flappy::flightlog
