#include "flightlog/check/check.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "flightlog/check/data_faults.hpp"
#include "flightlog/check/motion.hpp"
#include "flightlog/check/synthetic_log.hpp"
#include "flightlog/rotation.hpp"
#include "full.hpp"

namespace flappy::flightlog {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;
using flightlog::Column;
using flightlog::Finding;
using flightlog::FlightLog;
using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

std::vector<Column*> gyro(FlightLog& log) {
  return {&log.imu.gyro_x_rad_s, &log.imu.gyro_y_rad_s, &log.imu.gyro_z_rad_s};
}
std::vector<Column*> accel(FlightLog& log) {
  return {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.accel_z_m_s2};
}
std::vector<Column*> mocap(FlightLog& log) {
  flightlog::MocapStream& m = log.mocap;
  return {&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz};
}
void scale(const std::vector<Column*>& columns, double factor) {
  for (Column* c : columns) {
    for (double& v : *c) v *= factor;
  }
}
void shift(Column& column, double by) {
  for (double& v : column) v += by;
}
/// Leaves only the mocap samples that `kept` is true for.
void thin_mocap(FlightLog& log, const std::function<bool(std::size_t)>& kept) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < log.mocap.t_s.size(); ++i) {
    if (kept(i)) rows.push_back(i);
  }
  for (Column* c : mocap(log)) {
    Column left;
    for (const std::size_t i : rows) left.push_back((*c)[i]);
    *c = left;
  }
}

std::string describe(const flightlog::CheckReport& report) {
  std::string text;
  for (const flightlog::Finding& f : report.findings) {
    if (f.verdict != flightlog::Verdict::ok)
      text += f.check + (f.verdict == flightlog::Verdict::warning ? " warning: " : " not tested: ") + f.text + "\n";
  }
  return text;
}

/// Exactly these warnings, as "check: part of the text", after `corrupt` has changed a good log.
AssertionResult warns(const std::function<void(FlightLog&)>& corrupt, const std::vector<std::string>& expected,
                      const SyntheticMotion& motion = {.yaw_offset_rad = 0.7}) {
  FlightLog log = synthetic_log(motion);
  corrupt(log);
  const flightlog::CheckReport report = check_flight(log);
  for (const std::string& each : expected) {
    const std::string check = each.substr(0, each.find(": ")), part = each.substr(each.find(": ") + 2);
    bool found = false;
    for (const flightlog::Finding& f : report.findings)
      found |= f.verdict == flightlog::Verdict::warning && f.check == check && f.text.find(part) != std::string::npos;
    if (!found) return AssertionFailure() << "no warning of " << each << " in\n" << describe(report);
  }
  if (report.count(flightlog::Verdict::warning) != expected.size())
    return AssertionFailure() << "other warnings as well:\n" << describe(report);
  return AssertionSuccess();
}

TEST(Check, FindsNothingInGoodLogs) {
  for (std::uint64_t seed = 1; seed <= 20; seed += test::full() ? 1 : 4) {
    const double k = static_cast<double>(seed);
    const flightlog::CheckReport report =
        check_flight(synthetic_log({.yaw_offset_rad = 0.3 * k, .shake_rad = 0.0025 * k, .seed = seed}));
    EXPECT_EQ(report.count(flightlog::Verdict::warning), 0u) << describe(report);
    EXPECT_EQ(report.count(flightlog::Verdict::not_tested), 0u) << describe(report);
    EXPECT_EQ(report.streams.size(), 5u);
    EXPECT_EQ(report.findings.size(), 31u);
  }
}

// Of a rate on a line from sample to sample, against steps a thousand times as fine; what is left is of the fourth order
// in the turn of an interval, 0.06 rad, and of the finer steps.
TEST(SensorMotion, TurnsAsTheGyroSays) {
  FlightLog log = synthetic_log({.duration_s = 1});
  flightlog::ImuStream& s = log.imu;
  for (std::size_t i = 0; i < s.t_s.size(); ++i) {
    s.t_s[i] = log.mocap.t_s[0] - log.header.mocap.latency_s + log.header.imu.latency_s + static_cast<double>(i) / 200;
    const double beat = 2 * std::numbers::pi * 34 * static_cast<double>(i) / 200;
    s.gyro_x_rad_s[i] = 12 * std::cos(beat), s.gyro_y_rad_s[i] = 12 * std::sin(beat), s.gyro_z_rad_s[i] = 0.5;
  }
  const flightlog::SensorMotion motion(log);
  const double begin_s = 0.1013, end_s = begin_s + 4.0 / 34, step_s = 5e-6;
  Quaterniond turn = Quaterniond::Identity();
  for (double t = begin_s; t < end_s; t += step_s) {
    const double to = std::min(t + step_s, end_s);
    turn = turn * flightlog::exponential(*motion.mean_rate(t, to) * (to - t));
  }
  const Vector3d fine = flightlog::logarithm(turn) / (end_s - begin_s);
  EXPECT_GT(fine.z() - motion.mean_rate(begin_s, end_s)->z(), 0.2);  // coning
  EXPECT_LT((*motion.mean_turn(begin_s, end_s) - fine).norm(), 1e-4);
}

TEST(Check, SaysWhatItCannotTest) {
  const std::uint64_t seeds = test::full() ? 5 : 1;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const flightlog::CheckReport still = check_flight(synthetic_log({.rotation = 0, .translation = 0, .seed = seed}));
    EXPECT_EQ(describe(still),
              "clock not tested: too little rotation\ngyro not tested: too little rotation\n"
              "position scale not tested: too little acceleration\n");
    EXPECT_EQ(check_flight(synthetic_log({.rotation = 0.1, .translation = 0.1, .seed = seed}))
                  .count(flightlog::Verdict::warning),
              0u);
  }
  // Rotation that the gyro sees and mocap does not.
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const std::string text = describe(check_flight(synthetic_log({.rotation = 0.03, .seed = seed})));
    EXPECT_TRUE(text.starts_with("clock not tested: too little rotation\ngyro not tested: too little rotation\n"))
        << text;
  }
  EXPECT_EQ(describe(check_flight(synthetic_log({.duration_s = 1}))),
            "clock not tested: too short, or too many gaps\ngyro not tested: too short, or too many gaps\n"
            "accelerometer not tested: shorter than 2 s\n"
            "position scale not tested: needs an accelerometer that is understood\n"
            "imu beat not tested: shorter than 60 beats\npower beat not tested: shorter than 60 beats\n"
            "wings beat not tested: shorter than 60 beats\n");
}

// Shaking about two axes a quarter of a beat apart turns the body about the third by 0.17 rad/s, which the mean rate of
// the gyro lacks: 0.04 rad at 34 Hz are 8.5 rad/s, and 8.5^2 / (2 x 2 pi 34). What the gyro's low-pass hides of it, a
// sixth, is below the 0.085 rad/s that the declared bias leaves.
TEST(Check, TakesConingForNoBias) {
  for (const double coning : {0.04, -0.04}) {
    const SyntheticMotion motion = {.yaw_offset_rad = 0.7, .shake_rad = 0.04, .coning_rad = coning};
    EXPECT_TRUE(warns([](FlightLog&) {}, {}, motion));
    EXPECT_TRUE(warns([](FlightLog& log) { shift(log.imu.gyro_z_rad_s, 0.2); }, {"gyro bias: z 0."}, motion));
  }
}

TEST(Check, KnowsWhereTheImuSits) {
  const SyntheticMotion motion = {.rotation = 2, .translation = 0.2, .arm_m = 0.5};
  EXPECT_TRUE(warns([](FlightLog&) {}, {}, motion));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        log.header.imu.position_m = {0, 0, 0};
      },
      {"position scale: do not belong to this motion"}, motion));
}

TEST(Check, DescribesStreams) {
  FlightLog log = synthetic_log();
  thin_mocap(log, [](std::size_t i) { return i % 400 != 7; });
  const flightlog::CheckReport report = check_flight(log);
  ASSERT_EQ(report.streams[1].name, "mocap");
  const flightlog::StreamStatistics& s = report.streams[1];
  EXPECT_EQ(s.samples, 3990u);
  EXPECT_EQ(s.missing, 10u);
  EXPECT_EQ(s.declared_hz, 200);
  EXPECT_NEAR(s.rate_hz, 200, 0.05);
  EXPECT_NEAR(s.duration_s, 19.995, 2e-3);
  EXPECT_NEAR(s.longest_gap_s, 0.010, 1e-3);
  EXPECT_NEAR(s.jitter_s, 2e-4 * std::numbers::sqrt2, 2e-5);
  EXPECT_EQ(report.streams[0].declared_hz, std::nullopt);
}

TEST(Check, NamesDropoutsAndRates) {
  std::mt19937 random(1);
  EXPECT_TRUE(warns([&](FlightLog& log) { thin_mocap(log, [&](std::size_t) { return random() % 500 != 0; }); }, {}));
  EXPECT_TRUE(warns([&](FlightLog& log) { thin_mocap(log, [&](std::size_t) { return random() % 20 != 0; }); },
                    {"mocap: dropouts"}));
  EXPECT_TRUE(warns([](FlightLog& log) { thin_mocap(log, [](std::size_t i) { return i < 1000 || i > 1030; }); },
                    {"mocap: a gap of 0.159 s, at most 0.0882 s expected"}));
  EXPECT_TRUE(warns([](FlightLog& log) { thin_mocap(log, [](std::size_t i) { return i % 2 == 0; }); },
                    {"mocap: 100 samples/s, 200 declared"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        for (std::size_t i = 0; i < log.mocap.t_s.size(); i += 2) log.mocap.t_s[i] += 0.002;
      },
      {"mocap: intervals vary by 2"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        for (Column* c : mocap(log)) {
          if (c != &log.mocap.t_s) std::fill(c->begin() + 1000, c->begin() + 1200, (*c)[1000]);
        }
      },
      {"mocap: 199 of 4000 samples repeat the one before", "speed: positions jump"}));
}

TEST(Check, NamesUnitsAndAxesOfTheGyro) {
  EXPECT_TRUE(warns([](FlightLog& log) { scale(gyro(log), 180 / std::numbers::pi); },
                    {"gyro: the gyro is likely in deg/s, not rad/s"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&log.imu.gyro_y_rad_s}, -1); },
                    {"gyro: axes are flipped: gyro_x is the body's +x, gyro_y its -y, gyro_z its +z"}));
  EXPECT_TRUE(warns([](FlightLog& log) { std::swap(log.imu.gyro_x_rad_s, log.imu.gyro_y_rad_s); },
                    {"gyro: axes are swapped: gyro_x is the body's +y, gyro_y its +x, gyro_z its +z"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        scale(gyro(log), 180 / std::numbers::pi);
        scale({&log.imu.gyro_z_rad_s}, -1);
      },
      {"gyro: in deg/s, not rad/s, and axes are flipped: gyro_x is the body's +x, gyro_y its +y, gyro_z its -z"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&log.imu.gyro_z_rad_s}, 1e-3); }, {"gyro: a dead axis"}));
  EXPECT_TRUE(warns([](FlightLog& log) { shift(log.imu.gyro_x_rad_s, 0.3); }, {"gyro bias: x 0.3"}));
}

TEST(Check, NamesTheFormOfTheQuaternion) {
  const auto order = [](FlightLog& log) {
    const flightlog::MocapStream m = log.mocap;
    log.mocap.qw = m.qx, log.mocap.qx = m.qy, log.mocap.qy = m.qz, log.mocap.qz = m.qw;
  };
  const auto inverse = [](FlightLog& log) { scale({&log.mocap.qw}, -1); };
  for (const double yaw : {0.0, 0.7, 2.5}) {  // near level flight, and turned away from it
    if (yaw < 2 && !test::full()) continue;
    const SyntheticMotion motion = {.yaw_offset_rad = yaw};
    EXPECT_TRUE(warns(order, {"gyro: the quaternion order is likely x, y, z, w, not w, x, y, z"}, motion));
    EXPECT_TRUE(warns(inverse, {"gyro: the quaternion is likely inverse, world to body"}, motion));
    EXPECT_TRUE(warns([&](FlightLog& log) { inverse(log), order(log); },
                      {"gyro: the quaternion order is likely x, y, z, w and inverse, world to body"}, motion));
  }
}

TEST(Check, NamesUnitsAndAxesOfTheAccelerometer) {
  EXPECT_TRUE(warns([](FlightLog& log) { scale(accel(log), 1 / 9.81); }, {"accelerometer: likely in g, not m/s^2"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale(accel(log), -1); }, {"accelerometer: the sign is flipped"}));
  EXPECT_TRUE(
      warns([](FlightLog& log) { std::swap(log.imu.accel_x_m_s2, log.imu.accel_z_m_s2); },
            {"accelerometer: wrong axes: at rest it would point along the body's +z; it points along +x in B"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        for (Column* c : {&log.imu.gyro_y_rad_s, &log.imu.gyro_z_rad_s, &log.imu.accel_y_m_s2, &log.imu.accel_z_m_s2})
          scale({c}, -1);
      },
      {"gyro: gyro_x is the body's +x, gyro_y its -y, gyro_z its -z",
       "accelerometer: its axes are those of the gyro"}));
  // As a simulator does that reports acceleration: turned by the attitude at that time, to a few milliseconds.
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        std::size_t k = 0;
        for (std::size_t i = 0; i < log.imu.t_s.size(); ++i) {
          while (k + 1 < log.mocap.t_s.size() && log.mocap.t_s[k + 1] < log.imu.t_s[i] + 0.004) ++k;
          const Eigen::Quaterniond q(log.mocap.qw[k], log.mocap.qx[k], log.mocap.qy[k], log.mocap.qz[k]);
          const Eigen::Vector3d g = q.conjugate() * Eigen::Vector3d(0, 0, 9.81);
          for (int a = 0; a < 3; ++a) (*accel(log)[static_cast<std::size_t>(a)])[i] -= g(a);
        }
      },
      {"accelerometer: gravity is missing: acceleration instead of specific force"}));
}

TEST(Check, NamesUnitsAndAxesOfThePosition) {
  const auto in_mm = [](FlightLog& log) { scale({&log.mocap.x_m, &log.mocap.y_m, &log.mocap.z_m}, 1000); };
  EXPECT_TRUE(warns(
      [&](FlightLog& log) {
        in_mm(log);
        log.header.ambient = {1.18, -1e5, 1e5, {}};
      },
      {"position scale: likely in mm, not m", "speed: positions likely in mm, not m"}));
  EXPECT_TRUE(warns([](FlightLog& log) { shift(log.mocap.z_m, -1.4); }, {"space: below the ground"}));
  EXPECT_TRUE(warns([](FlightLog& log) { shift(log.mocap.x_m, 6); }, {"space: behind wall 0"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        log.mocap.y_m[500] += 3;
        log.mocap.y_m[501] += 3;
        log.header.ambient.walls.clear();
        log.header.mocap.position_noise_m = 0.05;
      },
      {"speed: positions jump"}));
  // y up, and the body with it
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        const Eigen::Quaterniond turn(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
        flightlog::MocapStream& m = log.mocap;
        for (std::size_t i = 0; i < m.t_s.size(); ++i) {
          const Eigen::Vector3d p = turn * Eigen::Vector3d(m.x_m[i], m.y_m[i], m.z_m[i]);
          const Eigen::Quaterniond q = turn * Eigen::Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i]);
          m.x_m[i] = p(0), m.y_m[i] = p(1), m.z_m[i] = p(2);
          m.qw[i] = q.w(), m.qx[i] = q.x(), m.qy[i] = q.y(), m.qz[i] = q.z();
        }
      },
      {"accelerometer: W is not z up", "upright: along +y", "space: below the ground"}));
}

TEST(Check, NamesClocks) {
  EXPECT_TRUE(warns([](FlightLog& log) { shift(log.imu.t_s, 0.005); }, {"clock: clocks apart, or a wrong latency"}));
  EXPECT_TRUE(warns([](FlightLog& log) { shift(log.imu.t_s, -0.3); }, {"clock: clocks apart, or a wrong latency"}));
  EXPECT_TRUE(
      warns([](FlightLog& log) { log.header.mocap.latency_s = 0; }, {"clock: clocks apart, or a wrong latency"}));
  const auto fast = [](double by) {
    return [by](FlightLog& log) {
      for (double& t : log.imu.t_s) t = 110 + (t - 110) * (1 + by);
    };
  };
  EXPECT_TRUE(warns(fast(5e-5), {}));
  EXPECT_TRUE(warns(fast(4e-4), {"clock speed: clocks run at different speeds"}));
  EXPECT_TRUE(warns(fast(-0.01), {"clock speed: clocks run at different speeds", "imu beat: beats 1.010"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        for (double& t : log.command.t_s) t *= 0.99;
      },
      {"imu beat: beats 0.990", "power beat: beats 0.990", "wings beat: beats 0.990", "left motor: positive expected",
       "right motor: positive expected"}));
  if (test::full())
    EXPECT_TRUE(warns(
        [](FlightLog& log) {
          for (double& t : log.imu.t_s) t = 130 + (t - 130) * 1.01;
        },
        {"clock speed: clocks run at different speeds", "imu beat: beats 0.990"}, {.duration_s = 60}));
  EXPECT_TRUE(warns([](FlightLog& log) { log.imu = synthetic_log({.seed = 99}).imu; },
                    {"gyro: another body or flight", "position scale: do not belong to this motion"}));
  FlightLog log = synthetic_log();
  log.header.mocap.latency_s = 0.15;
  shift(log.mocap.t_s, 0.144);
  EXPECT_EQ(describe(check_flight(log)),
            "latencies warning: mocap.latency_s = 0.15: at most 0.1 s expected: milliseconds?\n");
}

TEST(Check, MeasuresTheClock) {
  FlightLog log = synthetic_log({.duration_s = 60});
  for (double& t : log.imu.t_s) t = 130 + (t - 130) * 1.0005;
  const flightlog::CheckReport report = check_flight(log);
  const auto f = std::ranges::find(report.findings, "clock speed", &Finding::check);
  ASSERT_NE(f, report.findings.end());
  ASSERT_EQ(f->values.size(), 2U);
  ASSERT_EQ(f->values[1].first, "per_s");
  EXPECT_NEAR(f->values[1].second, 5e-4, 5e-5);
}

TEST(Check, NamesFaultsOfVoltagesAndPhase) {
  EXPECT_TRUE(warns([](FlightLog& log) { log.header.flapping_Hz = 30; },
                    {"flapping frequency: voltages beat at 34 Hz, 30 Hz declared", "stroke frequency: 30 Hz declared",
                     "wing-beat phase: another beat"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&*log.command.phase_rad}, 180 / std::numbers::pi); },
                    {"wing-beat phase: likely in degrees, not rad"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&*log.command.phase_rad}, 0.5 / std::numbers::pi); },
                    {"wing-beat phase: likely in beats, not rad"}));
  EXPECT_TRUE(warns([](FlightLog& log) { shift(*log.command.phase_rad, std::numbers::pi / 2); },
                    {"wing-beat phase: phase 0 is where the voltage peaks"}));
  std::mt19937 random(1);
  EXPECT_TRUE(warns(
      [&](FlightLog& log) {
        double slip = 0;
        for (double& phase : *log.command.phase_rad) {
          if (random() % 100 == 0) slip = static_cast<double>(random() % 60);
          phase += slip;
        }
      },
      {"wing-beat phase: an estimate that slipped"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&log.command.inputs->amplitude_V}, 0.5); },
                    {"wing-beat inputs: exceed bias_V"}));
  EXPECT_TRUE(warns([](FlightLog& log) { std::swap(log.command.left_voltage_V, log.command.right_voltage_V); },
                    {"wing-beat inputs: left and right swapped"}));
}

// A robot that rocks moves the waves of both voltages through the beat, against each other: one wing seems to beat faster, the other slower.
TEST(Check, TakesWhatRocksForNoOtherBeat) {
  FlightLog log = synthetic_log({});
  flightlog::CommandStream& u = log.command;
  for (std::size_t i = 0; i < u.t_s.size(); ++i) {
    constexpr double kRocks_Hz = 2, kRocks_V = 40;
    const double moved = 2 * std::numbers::pi * kRocks_Hz * u.t_s[i];
    u.left_voltage_V[i] += kRocks_V * std::cos((*u.phase_rad)[i] + moved);
    u.right_voltage_V[i] += kRocks_V * std::cos((*u.phase_rad)[i] - moved);
  }
  const flightlog::CheckReport report = check_flight(log);
  const auto f = std::ranges::find(report.findings, "flapping frequency", &Finding::check);
  ASSERT_NE(f, report.findings.end());
  EXPECT_EQ(f->verdict, Verdict::ok) << f->text;
}

TEST(Check, NamesAxesThatAreClipped) {
  const auto clip = [](FlightLog& log, double share) {
    Column& z = log.imu.accel_z_m_s2;
    Column sorted = z;
    std::ranges::sort(sorted);
    const double range = sorted[static_cast<std::size_t>((1 - share) * static_cast<double>(z.size() - 1))];
    for (double& v : z) v = std::min(v, range);
  };
  EXPECT_TRUE(warns([&](FlightLog& log) { clip(log, 0.004); }, {"imu range: of accel_z_m_s2"}));
  FlightLog log = synthetic_log();
  clip(log, 0.004);
  EXPECT_TRUE(data_faults(log, "flight").empty()) << "a few samples forbid nothing";
  clip(log, 0.03);
  const std::vector<DataFault> faults = data_faults(log, "flight");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].file, "flight/imu.csv");
  // readings of few digits repeat their largest value, too, but no more than those next to it
  EXPECT_TRUE(warns(
      [](FlightLog& rounded) {
        for (Column* c : accel(rounded))
          for (double& v : *c) v = 0.5 * std::round(2 * v);
      },
      {}));
}

TEST(Check, NamesABatteryThatFreezes) {
  const auto freeze = [](FlightLog& log, double from) {
    Column& v = log.power->battery_V;
    for (std::size_t i = static_cast<std::size_t>(from * static_cast<double>(v.size())); i < v.size(); ++i)
      v[i] = v[i - 1];
  };
  EXPECT_TRUE(warns([&](FlightLog& log) { freeze(log, 0.5); }, {"battery: frozen"}));
  EXPECT_TRUE(warns([](FlightLog& log) { std::ranges::fill(log.power->battery_V, 7.4); },
                    {"battery: all the time: not measured"}));
  EXPECT_TRUE(warns([&](FlightLog& log) { freeze(log, 0.9); }, {})) << "2 s may be chance";
}

TEST(Check, ToleratesAFilmOfAPart) {
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        flightlog::WingsStream& w = *log.wings;
        const Column t_s = w.t_s;
        for (Column* c :
             {&w.t_s, &w.left_stroke_rad, &w.left_rotation_rad, &w.right_stroke_rad, &w.right_rotation_rad}) {
          Column kept;
          for (std::size_t i = 0; i < t_s.size(); ++i)
            if (i * 10 / t_s.size() % 5 == 1 && i % 50 > 10) kept.push_back((*c)[i]);
          *c = kept;
        }
      },
      {}));
}

TEST(Check, NamesFaultsOfPowerAndWings) {
  EXPECT_TRUE(warns([](FlightLog& log) { log.header.power->battery_nominal_V = 3.7; }, {"battery: 3.7 V nominal"}));
  EXPECT_TRUE(
      warns([](FlightLog& log) { scale({&log.power->left_current_A}, -1); }, {"left motor: the current's sign"}));
  EXPECT_TRUE(warns([](FlightLog& log) { scale({&log.power->right_current_A}, 100); }, {"right motor: likely in mA"}));
  EXPECT_TRUE(warns(
      [](FlightLog& log) {
        scale({&log.wings->left_stroke_rad, &log.wings->right_rotation_rad}, 57.3);
      },
      {"left stroke: likely in degrees", "right rotation: likely in degrees"}));
  EXPECT_TRUE(
      warns([](FlightLog& log) { scale({&log.wings->right_stroke_rad}, 0.01); }, {"right stroke: a dead channel"}));
}

}  // namespace
}  // namespace flappy::flightlog
