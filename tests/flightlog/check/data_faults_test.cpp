// Faults planted in logs, synthetic ones and those of the blind robot: exactly the fault planted is named, and nothing
// where nothing was planted, whatever is wrong with the vehicle within what is thought plausible of it.
#include "flightlog/check/data_faults.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "flightlog/check/synthetic_log.hpp"
#include "full.hpp"
#include "lab/blind/a/flights.hpp"
#include "vehicles.hpp"

namespace flappy::flightlog {
namespace {

using flightlog::Column;
using flightlog::FlightLog;
using Columns = std::vector<Column*>;
using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

Columns mocap(FlightLog& log) {
  flightlog::MocapStream& m = log.mocap;
  return {&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz};
}
Columns imu(FlightLog& log) {
  flightlog::ImuStream& s = log.imu;
  return {&s.t_s, &s.gyro_x_rad_s, &s.gyro_y_rad_s, &s.gyro_z_rad_s, &s.accel_x_m_s2, &s.accel_y_m_s2, &s.accel_z_m_s2};
}
Columns command(FlightLog& log) {
  flightlog::CommandStream& u = log.command;
  return {&u.t_s,
          &u.left_voltage_V,
          &u.right_voltage_V,
          &*u.phase_rad,
          &u.inputs->amplitude_V,
          &u.inputs->difference_V,
          &u.inputs->bias_V,
          &u.inputs->split_cycle};
}
void scale(const Columns& columns, double factor) {
  for (Column* c : columns) {
    for (double& v : *c) v *= factor;
  }
}
/// Leaves only the samples of a stream that `kept` is true for.
void thin(const Columns& columns, const std::function<bool(std::size_t)>& kept) {
  for (Column* c : columns) {
    Column left;
    for (std::size_t i = 0; i < c->size(); ++i) {
      if (kept(i)) left.push_back((*c)[i]);
    }
    *c = left;
  }
}
void run_fast(Column& t_s, double speed = 1.01) {
  const double start = t_s.front();
  for (double& t : t_s) t = start + (t - start) * speed;
}
/// As a person would who kept the first seconds only.
void keep_first(FlightLog& log, double seconds) {
  const double end_s = log.command.t_s.front() + seconds;
  const auto cut = [&](const Columns& columns) {
    const Column t_s = *columns[0];
    thin(columns, [&](std::size_t i) { return t_s[i] < end_s; });
  };
  cut(command(log)), cut(mocap(log)), cut(imu(log));
  flightlog::PowerStream& p = *log.power;
  flightlog::WingsStream& w = *log.wings;
  cut({&p.t_s, &p.battery_V, &p.left_current_A, &p.right_current_A});
  cut({&w.t_s, &w.left_stroke_rad, &w.left_rotation_rad, &w.right_stroke_rad, &w.right_rotation_rad});
}

struct Planted {
  const char* name;
  std::function<void(FlightLog&)> plant;
  const char* file;
  std::size_t first_line, last_line;  ///< where it must be found to begin
  const char* what;
};

std::vector<Planted> all_faults() {
  constexpr std::size_t kEnd = 1000000;
  return {
      {"no overlap",
       [](FlightLog& log) {
         for (double& t : log.imu.t_s) t += 3600;
       },
       "imu.csv", 2, 2, "streams overlap by 0 s, at least 2 s needed; another clock"},
      {"IMU upside down",
       [](FlightLog& log) {
         flightlog::ImuStream& s = log.imu;
         scale({&s.gyro_y_rad_s, &s.gyro_z_rad_s, &s.accel_y_m_s2, &s.accel_z_m_s2}, -1);
       },
       "imu.csv", 2, 2, "gyro_y"},
      {"IMU turned by a quarter",
       [](FlightLog& log) {
         flightlog::ImuStream& s = log.imu;
         std::swap(s.gyro_x_rad_s, s.gyro_y_rad_s), std::swap(s.accel_x_m_s2, s.accel_y_m_s2);
         scale({&s.gyro_x_rad_s, &s.accel_x_m_s2}, -1);
       },
       "imu.csv", 2, 2, "gyro_y"},
      {"gyro in degrees",
       [](FlightLog& log) {
         flightlog::ImuStream& s = log.imu;
         scale({&s.gyro_x_rad_s, &s.gyro_y_rad_s, &s.gyro_z_rad_s}, 180 / std::numbers::pi);
       },
       "imu.csv", 2, 2, "deg/s, not rad/s"},
      {"wings in degrees",
       [](FlightLog& log) {
         flightlog::WingsStream& w = *log.wings;
         scale({&w.left_stroke_rad, &w.left_rotation_rad, &w.right_stroke_rad, &w.right_rotation_rad},
               180 / std::numbers::pi);
       },
       "wings.csv", 2, 2, "likely in degrees"},
      {"IMU's clock fast", [](FlightLog& log) { run_fast(log.imu.t_s); }, "imu.csv", 40, 120,
       "runs off those of the other streams by 0.99 %"},
      {"motion capture's clock fast", [](FlightLog& log) { run_fast(log.mocap.t_s); }, "mocap.csv", 15, 45,
       "runs off those of the other streams by"},
      {"voltages' clock fast", [](FlightLog& log) { run_fast(log.command.t_s); }, "command.csv", 80, 120,
       "runs off those of the other streams by 1 %"},
      {"60 % of motion capture missing",
       [](FlightLog& log) {
         std::mt19937 random(1);
         std::vector<bool> kept;
         for (std::size_t i = 0; i < log.mocap.t_s.size(); ++i) kept.push_back(random() % 10 >= 6);
         thin(mocap(log), [&](std::size_t i) { return kept[i]; });
       },
       "mocap.csv", 2, 20, "missing, at most 50 % can be"},
      {"60 % of the IMU missing, in one piece",
       [](FlightLog& log) {
         const std::size_t n = log.imu.t_s.size();
         thin(imu(log), [&](std::size_t i) { return i < n / 5 || i >= n * 4 / 5; });
       },
       "imu.csv", 300, 3000, "60 % of the flight's samples are missing, at most 50 % can be"},
      {"60 % of the voltages missing, at the end",
       [](FlightLog& log) {
         const std::size_t n = log.command.t_s.size();
         thin(command(log), [&](std::size_t i) { return i < n * 2 / 5; });
       },
       "command.csv", 1000, kEnd, "60 % of the flight's samples are missing, at most 50 % can be"},
      {"a meter frozen",
       [](FlightLog& log) {
         for (Column* c : {&log.power->left_current_A, &log.power->right_current_A})
           std::fill(c->begin() + static_cast<std::ptrdiff_t>(c->size() * 2 / 5), c->end(), c->back());
       },
       "power.csv", 1000, kEnd, "60 % of the flight's samples are missing, at most 50 % can be"},
      {"voltages' clock a little fast", [](FlightLog& log) { run_fast(log.command.t_s, 1.002); }, "command.csv", 300,
       600, "runs off those of the other streams by 0.2 %"},
      {"IMU's clock late, and drifting a little",
       [](FlightLog& log) {
         run_fast(log.imu.t_s, 1.0005);
         for (double& t : log.imu.t_s) t += 0.4;
       },
       "imu.csv", 2, 2, "clocks apart, or a wrong latency"},
      {"motion capture frozen",
       [](FlightLog& log) {
         for (Column* c : mocap(log)) {
           if (c != &log.mocap.t_s)
             std::fill(c->begin() + static_cast<std::ptrdiff_t>(c->size() * 2 / 5), c->end(), c->back());
         }
       },
       "mocap.csv", 200, 2000, "60 % of the flight's samples are missing, at most 50 % can be"},
      {"a rate that is none", [](FlightLog& log) { thin(imu(log), [](std::size_t i) { return i % 3 != 0; }); },
       "imu.csv", 2, 2, "samples/s, "},
      {"too short", [](FlightLog& log) { keep_first(log, 1.5); }, "", 200, 1600,
       "s, at least 2 s (68 beats) are needed"},
      {"positions in mm",
       [](FlightLog& log) {
         scale({&log.mocap.x_m, &log.mocap.y_m, &log.mocap.z_m}, 1000);
       },
       "mocap.csv", 2, 2, "likely in mm, not m"},
      {"accelerometer in g",
       [](FlightLog& log) {
         scale({&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.accel_z_m_s2}, 1 / 9.81);
       },
       "imu.csv", 2, 2, "likely in g, not m/s^2"},
      {"phase in degrees", [](FlightLog& log) { scale({&*log.command.phase_rad}, 180 / std::numbers::pi); },
       "command.csv", 2, 2, "likely in degrees, not rad"},
      {"phase of another convention",
       [](FlightLog& log) {
         for (double& phase : *log.command.phase_rad) phase -= std::numbers::pi / 2;
       },
       "command.csv", 2, 2, "phase 0 is where the voltage peaks"},
      {"amplitude halved", [](FlightLog& log) { scale({&log.command.inputs->amplitude_V}, 0.5); }, "command.csv", 2, 60,
       "exceed bias_V"},
      {"quaternion world to body",
       [](FlightLog& log) {
         scale({&log.mocap.qx, &log.mocap.qy, &log.mocap.qz}, -1);
       },
       "mocap.csv", 2, 2, "world to body"},
      {"currents in mA",
       [](FlightLog& log) {
         scale({&log.power->left_current_A, &log.power->right_current_A}, 1000);
       },
       "power.csv", 2, 2, "likely in mA"},
  };
}

std::string describe(const std::vector<flightlog::DataFault>& faults) {
  std::string text;
  for (const flightlog::DataFault& f : faults) text += f.file + ":" + std::to_string(f.line) + ": " + f.what + "\n";
  return text;
}

AssertionResult named_alone(FlightLog log, const Planted& p) {
  p.plant(log);
  const std::vector<flightlog::DataFault> faults = data_faults(log, "flights/a");
  if (faults.size() != 1) return AssertionFailure() << p.name << ": named\n" << describe(faults);
  const flightlog::DataFault& f = faults[0];
  if (!f.file.starts_with("flights/a/" + std::string(p.file)) || f.line < p.first_line || f.line > p.last_line ||
      f.what.find(p.what) == std::string::npos)
    return AssertionFailure() << p.name << ": named\n" << describe(faults);
  return AssertionSuccess();
}

FlightLog blind_log(std::uint64_t seed, std::size_t flight, const char* effect = nullptr, double size = 1) {
  blind::Case c{.vehicle = test::identified(), .vehicle_file = "hummingbird_identified.toml"};
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  c.seed = seed;
  c.power = c.wings = true;
  if (effect) c.magnitudes = blind::Magnitudes({{effect, size}});
  const blind::RobotFlight f = blind::fly(c, flight);
  EXPECT_FALSE(f.crashed) << f.how;
  return f.log;
}

TEST(DataFaults, OfSyntheticLogs) {
  for (std::uint64_t seed = 1; seed <= (test::full() ? 3 : 1); ++seed) {
    const FlightLog log = synthetic_log({.duration_s = 10, .yaw_offset_rad = 0.7, .seed = seed});
    EXPECT_EQ(describe(data_faults(log, "a")), "");
    for (const Planted& p : all_faults()) EXPECT_TRUE(named_alone(log, p));
  }
}

// A camera's memory holds seconds, and a wing hides the other.
TEST(DataFaults, AFilmMayHoldAPartOfAFlight) {
  const FlightLog log = synthetic_log({.duration_s = 10});
  const auto filmed = [&](const std::function<bool(std::size_t)>& keeps) {
    FlightLog film = log;
    flightlog::WingsStream& w = *film.wings;
    thin({&w.t_s, &w.left_stroke_rad, &w.left_rotation_rad, &w.right_stroke_rad, &w.right_rotation_rad}, keeps);
    return describe(data_faults(film, "a"));
  };
  const std::size_t n = log.wings->t_s.size();
  EXPECT_EQ(filmed([&](std::size_t i) { return i * 10 / n % 5 == 1 && i % 50 > 10; }), "") << "2 s, a fifth hidden";
  EXPECT_NE(filmed([&](std::size_t i) { return i % 2 == 0; }).find("declared: thinned out"), std::string::npos);
}

TEST(DataFaults, OfFlights) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  for (const std::size_t flight : {0, 1, 2}) {
    const FlightLog log = blind_log(1 + flight, flight);
    EXPECT_EQ(describe(data_faults(log, "a")), "");
    for (const Planted& p : all_faults()) EXPECT_TRUE(named_alone(log, p)) << flight;
  }
}

TEST(DataFaults, AreNotEffects) {
  if (!test::full()) GTEST_SKIP() << "takes ten seconds: with --full";
  for (const char* effect : {"vibration_rectification", "stop_compliance", "com_offset", "driver_dead_zone"})
    EXPECT_EQ(describe(data_faults(blind_log(7, 0, effect), "a")), "") << effect;
  // where what is thought plausible of sensors ends; a rectification that large bends the mean force as another attitude would
  for (const char* effect : {"gyro_bias", "accelerometer_misalignment", "mocap_tilt", "marker_offset", "mocap_delay"})
    EXPECT_EQ(describe(data_faults(blind_log(7, 0, effect, 3), "a")), "") << effect;
}

TEST(DataFaults, AShortFlightIsNone) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    FlightLog log = blind_log(seed, 0);
    keep_first(log, 3);
    EXPECT_EQ(describe(data_faults(log, "a")), "");
  }
}

}  // namespace
}  // namespace flappy::flightlog
