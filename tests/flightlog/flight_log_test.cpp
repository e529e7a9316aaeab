#include "flightlog/flight_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>

#include "flightlog/log_world.hpp"
#include "flightlog/readings.hpp"
#include "flightlog/some_log.hpp"
#include "io/files.hpp"
#include "io/read_files.hpp"
#include "refusal.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;

/// Digits that no decimal has, in every column; unit quaternions to the last digit.
flightlog::FlightLog sample_log() {
  flightlog::FlightLog log;
  flightlog::FlightHeader& h = log.header;
  h.vehicle = "hummingbird \"seven\".toml";
  h.vehicle_sha256 = std::string(64, 'a');
  h.flapping_Hz = 34;
  h.gravity_m_s2 = 9.80665;
  h.ambient = {1.0 / 0.85, -0.0, 2.5, {{1.0 / 3, -2, 0, -1}, {4, 0, 0.6, 0.8}}};
  h.mocap = {200, 1.0 / 300, 1e-4, 2e-3};
  h.imu = {500, 2e-3, 80, {1e-3, -1.0 / 7000, 0}, 0.01, {0.02, 0.03, 1.0 / 30}, 0.3};
  h.power = {7.4, 1000, 0.5e-3, 0.01, 0.02};
  h.wings = {1000, 0.01};
  const auto column = [](double scale) {
    flightlog::Column c;
    for (int i = 0; i < 5; ++i) c.push_back(scale * std::sin(1.0 + i));
    return c;
  };
  flightlog::Column t_s;
  for (int i = 0; i < 5; ++i) t_s.push_back(i / 300.0);
  log.command = {t_s, column(9), column(8), flightlog::BeatInputs{column(7), column(1), column(0.5), column(0.1)},
                 column(3)};
  flightlog::Column qw, qx;
  for (int i = 0; i < 5; ++i) qw.push_back(std::cos(i / 9.0)), qx.push_back(std::sin(i / 9.0));
  log.mocap = {t_s, column(1), column(2), column(3), qw, qx, flightlog::Column(5, 0.0), flightlog::Column(5, -0.0)};
  log.imu = {t_s, column(4), column(5), column(6), column(7), column(8), column(9)};
  log.power = flightlog::PowerStream{t_s, column(7), column(0.3), column(-0.4)};
  log.wings = flightlog::WingsStream{t_s, column(1.1), column(0.7), column(1.2), column(0.8)};
  return log;
}

std::string message(const std::function<void()>& action) {
  try {
    action();
    return "accepted";
  } catch (const io::InputError& error) {
    return error.what();
  }
}

/// What a person sees when `old` in a file of a good log has become `fresh`.
std::string edited(const std::string& name, const std::string& old, const std::string& fresh) {
  flightlog::LogFiles files = flight_log_files(sample_log());
  const std::size_t at = files.at(name).find(old);
  if (at == std::string::npos) return "\"" + old + "\" is not in " + name;
  files[name].replace(at, old.size(), fresh);
  return message([&] { flightlog::parse_flight_log(files, "log"); });
}

/// The same when line `number` of a file is another one.
std::string with_line(const std::string& name, int number, const std::string& line) {
  flightlog::LogFiles files = flight_log_files(sample_log());
  std::string& text = files.at(name);
  std::size_t begin = 0;
  for (int i = 1; i < number; ++i) begin = text.find('\n', begin) + 1;
  text.replace(begin, text.find('\n', begin) - begin, line);
  return message([&] { flightlog::parse_flight_log(files, "log"); });
}

TEST(FlightLog, ReadsBackExactly) {
  const flightlog::FlightLog log = sample_log();
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);
  flightlog::FlightLog flown = log;
  flown.header.flown = {.start_s = 0.1,
                        .start_pose = {{0.1, 0.2, 1, 1, 0, 0, 0}},
                        .mode = "hover",
                        .begin_s = 2,
                        .hand_back_s = 2.6,
                        .policy_crc32 = 4294967295U,
                        .controller_crc32 = 1};
  flown.header.policy = {"observation_x_error", "action_added_bias"};
  flown.policy = {{0.1, 0.2, 0.3}, {{1, 2, 3}, {0.25, 0, -1e-7}}};
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(flown), "log"), flown);
  flightlog::FlightLog least = log;
  least.header.vehicle_sha256.clear();
  least.header.ambient.walls.clear();
  least.header.power.reset();
  least.header.wings.reset();
  least.command.inputs.reset();
  least.command.phase_rad.reset();
  least.power.reset();
  least.wings.reset();
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(least), "log"), least);
  EXPECT_EQ(flight_log_files(least).size(), 4u);
}

/// Of a robot that is driven by other things than two voltages: three inputs, an IMU without gyro, a battery alone.
flightlog::FlightLog log_of_inputs() {
  flightlog::FlightLog log = sample_log();
  flightlog::FlightHeader& h = log.header;
  h.inputs = {"left_flap", "pitch_servo", "lamp2"};
  h.flapping_Hz = 0;
  h.imu.gyro = false, h.imu.gyro_noise_rad_s = 0, h.imu.gyro_bias_sd_rad_s = {0, 0, 0};
  h.power->currents = false, h.power->current_noise_A = 0;
  h.wings.reset();
  h.attitude = {100, 1.0 / 300, 0.02};
  flightlog::CommandStream& c = log.command;
  c.declared = {c.left_voltage_V, c.right_voltage_V, flightlog::Column(5, 65535)};
  c.left_voltage_V.clear(), c.right_voltage_V.clear(), c.inputs.reset(), c.phase_rad.reset();
  flightlog::ImuStream& u = log.imu;
  for (flightlog::Column* gyro : {&u.gyro_x_rad_s, &u.gyro_y_rad_s, &u.gyro_z_rad_s}) gyro->clear();
  log.power->left_current_A.clear(), log.power->right_current_A.clear();
  log.wings.reset();
  const flightlog::MocapStream& m = log.mocap;
  log.attitude = flightlog::AttitudeStream{m.t_s, m.qx, m.qw, m.qy, m.qz};
  return log;
}

TEST(FlightLog, OfDeclaredInputsReadsBackExactly) {
  flightlog::FlightLog log = log_of_inputs();
  log.header.session = "battery 2";
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);
  EXPECT_EQ(flight_log_files(log).at("command.csv").substr(0, 31), "t_s,left_flap,pitch_servo,lamp2");
  log.header.imu = {};
  log.imu = {};
  log.header.flapping_Hz = 14.7;
  log.header.attitude.reset();
  log.attitude.reset();
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);
  EXPECT_EQ(flight_log_files(log).size(), 4u);
}

TEST(FlightLog, OfDeclaredInputsIsRefusedWhereItIsFaulty) {
  const auto edited = [](const std::string& name, const std::string& old, const std::string& fresh) {
    flightlog::LogFiles files = flight_log_files(log_of_inputs());
    const std::size_t at = files.at(name).find(old);
    if (at == std::string::npos) return "\"" + old + "\" is not in " + name;
    files[name].replace(at, old.size(), fresh);
    return message([&] { flightlog::parse_flight_log(files, "log"); });
  };
  const auto header = [&](const std::string& old, const std::string& fresh) {
    return edited("flight.toml", old, fresh);
  };
  const std::string names = "; accepted: names of columns, of letters, digits and _";
  const std::string inputs = R"(["left_flap", "pitch_servo", "lamp2"])";
  EXPECT_EQ(header(inputs, "[]"), "log/flight.toml:13:10: command.inputs: is empty" + names);
  EXPECT_EQ(header("lamp2", "lamp,2"),
            "log/flight.toml:13:10: command.inputs: \"lamp,2\" is no name of a column" + names);
  EXPECT_EQ(header("lamp2", "t_s"), "log/flight.toml:13:10: command.inputs: \"t_s\" is no name of a column" + names);
  EXPECT_EQ(header("lamp2", "left_flap"),
            "log/flight.toml:13:10: command.inputs: \"left_flap\" is there twice; accepted: each once");
  EXPECT_EQ(header("[command]\ninputs = " + inputs, ""),
            "log/flight.toml: flapping_Hz: is missing; accepted: a number above 0, at most 10000");
  EXPECT_EQ(header("[command]\ninputs = " + inputs, "[command]"),
            "log/flight.toml:12:1: command.inputs: is missing; accepted: an array of strings");
  EXPECT_EQ(edited("command.csv", "lamp2", "lamp"),
            "log/command.csv:1: lamp: unknown column; accepted: t_s, left_flap, pitch_servo, lamp2; did you mean "
            "\"lamp2\"?");
  EXPECT_EQ(edited("command.csv", "65535", "6553500"),
            "log/command.csv:2: lamp2: 6553500 is out of range; accepted: a number from -1e+06 to 1e+06");
  EXPECT_EQ(header("gyro = false", "gyro = true"),
            "log/flight.toml:21:1: imu.gyro_noise_rad_s: is missing; accepted: a number from 0 to 100");
  EXPECT_EQ(edited("imu.csv", "accel_x_m_s2", "gyro_x_rad_s"),
            "log/imu.csv:1: gyro_x_rad_s: unknown column; accepted: t_s, accel_x_m_s2, accel_y_m_s2, accel_z_m_s2");
  EXPECT_EQ(header("[attitude]\nrate_hz = 100.0\nlatency_s = 0.0033333333333333335\nnoise_rad = 0.02\n", ""),
            "log/attitude.csv: is there, but flight.toml has no [attitude]; accepted: [attitude], or no attitude.csv");
  flightlog::LogFiles files = flight_log_files(log_of_inputs());
  files.erase("imu.csv");
  EXPECT_EQ(message([&] { flightlog::parse_flight_log(files, "log"); }),
            "log/imu.csv: is missing; accepted: a folder with flight.toml, command.csv, mocap.csv and imu.csv");
  // A log with voltages has all of these.
  flightlog::LogFiles plain = flight_log_files(sample_log());
  plain["flight.toml"].replace(plain["flight.toml"].find("[imu]\n"), 6, "[imu]\ngyro = false\n");
  EXPECT_EQ(message([&] { flightlog::parse_flight_log(plain, "log"); }),
            "log/flight.toml:20:8: imu.gyro: is false in a log with voltages; accepted: true, or [command] inputs");
  EXPECT_EQ(message([&] { flightlog::require_voltages(log_of_inputs(), "log"); }),
            "log: is driven by left_flap, pitch_servo, lamp2; accepted: a flight driven by left_voltage_V and "
            "right_voltage_V");
  EXPECT_EQ(message([&] { flightlog::require_voltages(sample_log(), "log"); }), "accepted");
}

/// The log of a clamped robot.
FlightLog clamped_log() {
  FlightLog log = sample_log();
  log.header.mocap = {}, log.header.imu = {}, log.header.attitude.reset(), log.header.policy.clear();
  log.mocap = {}, log.imu = {}, log.attitude.reset(), log.policy.reset(), log.header.flown.reset();
  log.header.rig = {1000, 1e-3, {0.01, 0, -1.0 / 70}, {0.6, 0, 0.8, 0}, 3e-3, 16e-6, 400};
  const Column& t_s = log.command.t_s;
  log.forces = ForcesStream{t_s, t_s, t_s, t_s, t_s, t_s, t_s};
  return log;
}

TEST(FlightLog, OfAClampedRobotReadsBackExactly) {
  const FlightLog log = clamped_log();
  const LogFiles files = flight_log_files(log);
  EXPECT_FALSE(files.contains("mocap.csv") || files.contains("imu.csv"));
  EXPECT_EQ(parse_flight_log(files, "bench"), log);
  EXPECT_EQ(test::refusal([&] { require_flown(log, "bench"); }),
            "bench: is of a clamped robot; accepted: the log of a flight, without [rig]");
}

TEST(FlightLog, OfAClampedRobotIsRefusedWhereItIsFaulty) {
  const auto refused = [](const std::function<void(LogFiles&)>& spoil) {
    LogFiles files = flight_log_files(clamped_log());
    spoil(files);
    return test::refusal([&] { parse_flight_log(files, "bench"); });
  };
  EXPECT_EQ(
      refused([](LogFiles& f) { f.erase("forces.csv"); }),
      "bench/forces.csv: is missing; accepted: a folder with flight.toml, command.csv and forces.csv, as [rig] says");
  EXPECT_EQ(refused([](LogFiles& f) { f["mocap.csv"] = "t_s\n"; }),
            "bench/mocap.csv: is there, but flight.toml has [rig]; accepted: forces.csv alone, or no [rig]");
  EXPECT_NE(refused([](LogFiles& f) { f["flight.toml"] += "\n[mocap]\n"; }).find("is of a robot that flies"),
            std::string::npos);
  const auto edited = [&](const std::string& from, const std::string& to) {
    return refused([&](LogFiles& f) {
      std::string& text = f["flight.toml"];
      text.replace(text.find(from), from.size(), to);
    });
  };
  EXPECT_NE(edited("\"clamped\"", "\"string\"").find("accepted: \"clamped\""), std::string::npos);
  EXPECT_NE(edited("attitude = [0.6", "attitude = [0.7").find("a quaternion w, x, y, z of length 1"),
            std::string::npos);
}

TEST(FlightLog, KeepsUnitQuaternionsToTheLastDigit) {
  flightlog::FlightLog log = sample_log();
  flightlog::MocapStream& m = log.mocap;
  m = {};
  for (int i = 0; i < 1000; ++i) {
    const double w = std::cos(i), x = std::sin(2.0 * i), y = std::sin(3.0 * i), z = std::cos(5.0 * i);
    const double length = std::sqrt(w * w + x * x + y * y + z * z);
    m.t_s.push_back(1e-3 * i);
    for (flightlog::Column* c : {&m.x_m, &m.y_m, &m.z_m}) c->push_back(i);
    m.qw.push_back(w / length), m.qx.push_back(x / length), m.qy.push_back(y / length), m.qz.push_back(z / length);
  }
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);
}

TEST(FlightLog, TakesColumnsInAnyOrder) {
  flightlog::LogFiles files = flight_log_files(sample_log());
  files["power.csv"] = "right_current_A,battery_V,t_s,left_current_A\n1,2,0,3\n4,5,0.01,6\n";
  const flightlog::FlightLog log = flightlog::parse_flight_log(files, "log");
  EXPECT_EQ(*log.power, (flightlog::PowerStream{{0, 0.01}, {2, 5}, {3, 6}, {1, 4}}));
}

TEST(FlightLog, HasTheSolidsOfAWorld) {
  const sim::Shape shapes[] = {sim::sphere({1, 2, 3}, 0.5), sim::box({0, 1, 0}, {1, 2, 0.5}, {0.1, -0.2, 2}),
                               sim::cylinder({0, -1, 1}, {0.5, 1, 2}, 0.1), sim::cylinder({0, 0, 1}, {0, 0, 0}, 0.2)};
  flightlog::FlightLog log = sample_log();
  for (const sim::Shape& s : shapes) flightlog::add_solid(s, log.header.ambient);
  const flightlog::FlightLog back = flightlog::parse_flight_log(flight_log_files(log), "log");
  EXPECT_EQ(back, log);
  const sim::World world = flightlog::world_of(back.header);
  ASSERT_EQ(world.shapes.size(), 4u);
  EXPECT_EQ(world.ground_z_m, log.header.ambient.ground_z_m);
  EXPECT_EQ(world.walls.size(), log.header.ambient.walls.size());
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(world.shapes[i].kind, shapes[i].kind);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(world.shapes[i].centre_m[k], shapes[i].centre_m[k], 1e-15);
      EXPECT_NEAR(world.shapes[i].half_m[k], shapes[i].half_m[k], 1e-15);
    }
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(world.shapes[i].attitude[k], shapes[i].attitude[k], 1e-15);
  }
  const auto refused = [](const std::string& line) {
    return edited("flight.toml", "ceiling_z_m = 2.5", "ceiling_z_m = 2.5\n" + line);
  };
  EXPECT_EQ(
      refused("spheres = [[0, 0, 0, -1]]"),
      "log/flight.toml:11:11: ambient.spheres: number 0 is no solid; accepted: [x_m, y_m, z_m, radius_m], the radius "
      "above 0");
  EXPECT_EQ(
      refused("boxes = [[0, 0, 0, 1, 1, 1, 1, 1, 0, 0]]"),
      "log/flight.toml:11:9: ambient.boxes: number 0 is no solid; accepted: [x_m, y_m, z_m, three edges above 0, qw, "
      "qx, qy, qz], the quaternion of length 1");
  EXPECT_EQ(
      refused("cylinders = [[0, 0, 1, 0, 0, 1, 1]]"),
      "log/flight.toml:11:13: ambient.cylinders: number 0 is no solid; accepted: [two ends of the axis, radius_m], "
      "the radius above 0");
}

TEST(FlightLog, NormalisesQuaternionsAndNormals) {
  flightlog::LogFiles files = flight_log_files(sample_log());
  files["mocap.csv"] = "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1.0009,0,0,0\n0.01,0,0,0,0.7071,0,0,0.7071\n";
  std::string& header = files["flight.toml"];
  header.replace(header.find("0.6, 0.8"), 8, "0.7071, 0.7071");
  const flightlog::FlightLog log = flightlog::parse_flight_log(files, "log");
  EXPECT_DOUBLE_EQ(log.mocap.qw[0], 1);
  EXPECT_DOUBLE_EQ(log.mocap.qz[1], std::numbers::sqrt2 / 2);
  EXPECT_DOUBLE_EQ(log.header.ambient.walls[1].normal_x, std::numbers::sqrt2 / 2);
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);
}

TEST(FlightLog, RefusesFaultyHeaders) {
  const auto header = [](const std::string& old, const std::string& fresh) {
    return edited("flight.toml", old, fresh);
  };
  EXPECT_EQ(header("schema = 1", "schema = 2"),
            "log/flight.toml:1:10: schema: 2 is read by a newer flappy than this one; accepted: 1");
  EXPECT_EQ(header("schema = 1", "schema = 0"), "log/flight.toml:1:10: schema: 0 is read by no flappy; accepted: 1");
  EXPECT_EQ(
      header("gravity_m_s2", "gravity"),
      "log/flight.toml:5:1: gravity: unknown key; accepted: ambient, attitude, changes, command, flapping_Hz, flown, "
      "gravity_m_s2, imu, "
      "mocap, policy, power, rig, schema, session, vehicle, vehicle_sha256, wings");
  EXPECT_EQ(header("gravity_m_s2 = 9.8", "# "),
            "log/flight.toml: gravity_m_s2: is missing; accepted: a number from 0 to 100");
  EXPECT_EQ(header("flapping_Hz = 34.0", "flapping_Hz = -34.0"),
            "log/flight.toml:4:15: flapping_Hz: -34 is out of range; accepted: a number above 0, at most 10000");
  EXPECT_EQ(
      header("\"hummingbird", "\"../hummingbird"),
      "log/flight.toml:2:11: vehicle: \"../hummingbird \"seven\".toml\" is no file name; accepted: the name of the "
      "vehicle's file, without folder");
  EXPECT_EQ(header("aaaa", "AAAA"),
            "log/flight.toml:3:18: vehicle_sha256: is no SHA-256; accepted: 64 digits of 0 to 9 and a to f");
  EXPECT_EQ(header("aaaa", "aaa"),
            "log/flight.toml:3:18: vehicle_sha256: is no SHA-256; accepted: 64 digits of 0 to 9 and a to f");
  EXPECT_EQ(header("ceiling_z_m = 2.5", "ceiling_z_m = -1"),
            "log/flight.toml:10:15: ambient.ceiling_z_m: -1 is not above the ground; accepted: a number above -0");
  EXPECT_EQ(header("0.6, 0.8", "0.0, -2.0"),
            "log/flight.toml:11:9: ambient.walls: normal of wall 1 has length 2; accepted: [x_m, y_m, "
            "normal_x, normal_y], the normal of length 1");
  EXPECT_EQ(header(", 0.6, 0.8", ", 0.6"),
            "log/flight.toml:11:49: ambient.walls[1]: has 3 elements; accepted: an array of 4, each a number from "
            "-1e+06 to 1e+06");
  EXPECT_EQ(header("latency_s = 0.002", "latency_s = -0.002"),
            "log/flight.toml:21:13: imu.latency_s: -0.002 is out of range; accepted: a number from 0 to 10");
  EXPECT_EQ(header("bandwidth_hz", "bandwith_hz"),
            "log/flight.toml:19:1: imu.bandwidth_hz: is missing; accepted: a number above 0, at most 1e+06; is it "
            "misspelt as \"bandwith_hz\"?");
  EXPECT_EQ(header("noise_rad = 0.01", "noise_rad = 0.01\nlatency_s = 0"),
            "log/flight.toml:38:1: wings.latency_s: unknown key; accepted: noise_rad, rate_hz");
}

TEST(FlightLog, RefusesFaultyColumns) {
  const std::string imu = "t_s, gyro_x_rad_s, gyro_y_rad_s, gyro_z_rad_s, accel_x_m_s2, accel_y_m_s2, accel_z_m_s2";
  EXPECT_EQ(edited("imu.csv", "gyro_x_rad_s", "gyro_x_rads"),
            "log/imu.csv:1: gyro_x_rads: unknown column; accepted: " + imu + "; did you mean \"gyro_x_rad_s\"?");
  EXPECT_EQ(edited("mocap.csv", "x_m", "x_mm"),
            "log/mocap.csv:1: x_mm: unknown column; accepted here with another unit: \"x_m\"");
  EXPECT_EQ(edited("mocap.csv", "y_m", "x_m"), "log/mocap.csv:1:9: x_m: column name is given twice");
  flightlog::LogFiles files = flight_log_files(sample_log());
  files["imu.csv"] = "t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2\n0,0,0,0,0,0\n";
  EXPECT_EQ(message([&] { flightlog::parse_flight_log(files, "log"); }),
            "log/imu.csv:1: accel_z_m_s2: column is missing; accepted: " + imu);
  EXPECT_EQ(
      edited("command.csv", "amplitude_V", "voltage_V"),
      "log/command.csv:1: voltage_V: unknown column; accepted: t_s, left_voltage_V, right_voltage_V, amplitude_V, "
      "difference_V, bias_V, split_cycle, phase_rad");
  files["command.csv"] = "t_s,left_voltage_V,right_voltage_V,amplitude_V,bias_V\n0,0,0,0,0\n1,0,0,0,0\n";
  EXPECT_EQ(message([&] { flightlog::parse_flight_log(files, "log"); }),
            "log/command.csv:1: difference_V, split_cycle: missing, while other inputs of the wing beat are given; "
            "accepted: all "
            "four or none");
}

TEST(FlightLog, RefusesFaultySamples) {
  EXPECT_EQ(with_line("power.csv", 4, "0.002,7,0,0"),
            "log/power.csv:4: t_s: 0.002 does not come after 0.0033333333333333335 of the line before; accepted: times "
            "that increase");
  EXPECT_EQ(with_line("mocap.csv", 3, "0,0,0,0,1,0,0,0"),
            "log/mocap.csv:3: t_s: 0 does not come after 0 of the line before; accepted: times that increase");
  EXPECT_EQ(with_line("wings.csv", 2, "0,nan,0,0,0"),
            "log/wings.csv:2:3: left_stroke_rad: nan is not finite; accepted: a number");
  EXPECT_EQ(
      with_line("mocap.csv", 5, "0.01,0,0,0,1,0.1,0,0"),
      "log/mocap.csv:5: qw, qx, qy, qz: length is 1.004987562112089; accepted: a quaternion of length 1 to within "
      "0.001");
  EXPECT_EQ(with_line("mocap.csv", 5, "0.01,0,0,0,0,0,0,0"),
            "log/mocap.csv:5: qw, qx, qy, qz: length is 0; accepted: a quaternion of length 1 to within 0.001");
  EXPECT_EQ(with_line("command.csv", 6, "1,9000,0,0,0,0,0,0"),
            "log/command.csv:6: left_voltage_V: 9000 is out of range; accepted: a number from -1000 to 1000");
  EXPECT_EQ(with_line("command.csv", 6, "1,0,0,0,0,0,0.6,0"),
            "log/command.csv:6: split_cycle: 0.6 is out of range; accepted: a number from -0.5 to 0.5");
  EXPECT_EQ(with_line("power.csv", 2, "0,7000,2,0"),
            "log/power.csv:2: battery_V: 7000 is out of range; accepted: a number from -1000 to 1000");
  EXPECT_EQ(with_line("imu.csv", 3, "0.001,0,0,0,0,0"),
            "log/imu.csv:3:16: row has 6 cells; accepted: 7, as in the header");
}

/// Whoever declares a stream and does not have it is done without it.
TEST(FlightLog, AsksForADeclaredStreamOnlyWhereItIsUsed) {
  flightlog::LogFiles files = flight_log_files(sample_log());
  files.erase("power.csv");
  files.erase("wings.csv");
  flightlog::FlightLog expected = sample_log();
  expected.power.reset();
  expected.wings.reset();
  const flightlog::FlightLog log = flightlog::parse_flight_log(files, "log");
  EXPECT_EQ(log, expected);
  EXPECT_TRUE(log.header.power && log.header.wings);
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), expected);
}

TEST(FlightLog, RefusesWhatIsMissingOrApart) {
  const auto changed = [](const std::function<void(flightlog::LogFiles&)>& change) {
    flightlog::LogFiles files = flight_log_files(sample_log());
    change(files);
    return message([&] { flightlog::parse_flight_log(files, "log"); });
  };
  EXPECT_EQ(changed([](flightlog::LogFiles& f) { f.erase("imu.csv"); }),
            "log/imu.csv: is missing; accepted: a folder with flight.toml, command.csv, mocap.csv and imu.csv");
  EXPECT_EQ(changed([](flightlog::LogFiles& f) {
              std::string& header = f["flight.toml"];
              header.resize(header.find("\n[wings]"));
            }),
            "log/wings.csv: is there, but flight.toml has no [wings]; accepted: [wings], or no wings.csv");
  EXPECT_EQ(
      changed([](flightlog::LogFiles& f) { f["wings.csv"] = f["wings.csv"].substr(0, f["wings.csv"].find('\n')); }),
      "log/wings.csv: holds 0 samples; accepted: at least 2");
  EXPECT_EQ(changed([](flightlog::LogFiles& f) { f["wings.csv"].resize(f["wings.csv"].find("\n0.00")); }),
            "log/wings.csv: holds 1 samples; accepted: at least 2");
  EXPECT_EQ(changed([](flightlog::LogFiles& f) { f["power.csv"] = ""; }),
            "log/power.csv: is empty; accepted: a line of column names, then rows of numbers");
  EXPECT_EQ(changed([](flightlog::LogFiles& f) {
              f["power.csv"] = "t_s,battery_V,left_current_A,right_current_A\n0.5,7,0,0\n0.6,7,0,0\n";
            }),
            "log/power.csv:2: t_s: begins at 0.5 s, when command.csv has ended at 0.013333333333333334 s; accepted: "
            "streams that overlap, of one clock");
}

class FlightLogFolder : public testing::Test {
 protected:
  ~FlightLogFolder() override { fs::remove_all(root_); }

  std::vector<std::string> names() const {
    std::vector<std::string> list;
    for (const auto& entry : fs::directory_iterator(root_)) list.push_back(entry.path().filename());
    std::ranges::sort(list);
    return list;
  }
  std::string write_message(const fs::path& folder, const flightlog::FlightLog& log = sample_log()) const {
    return message([&] { write_flight_log(folder, log); });
  }
  std::string read_message(const fs::path& folder) const {
    return message([&] { flightlog::read_flight_log(folder); });
  }

  const fs::path root_ =
      testing::TempDir() + "flappy_log_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = fs::create_directories(root_);
  const fs::path folder_ = root_ / "flight_1";
};

TEST_F(FlightLogFolder, IsWrittenAndReplacedAsAWhole) {
  write_flight_log(root_ / "a" / "b/", sample_log());
  EXPECT_EQ(flightlog::read_flight_log(root_ / "a" / "b"), sample_log());
  fs::remove_all(root_ / "a");

  fs::create_directory(folder_);
  write_flight_log(folder_, sample_log());
  flightlog::write_truth(folder_, {"t_s", "x_m"}, {{0, 1}, {2, 3}});
  flightlog::write_vehicle(folder_, sample_log().header.vehicle, "mass");
  EXPECT_EQ(io::read_text(folder_ / "truth.csv"), "t_s,x_m\n0,2\n1,3\n");
  EXPECT_EQ(flightlog::read_flight_log(folder_), sample_log());

  flightlog::FlightLog other = sample_log();
  other.header.power.reset();
  other.power.reset();
  other.header.policy = {"observation_x_error", "action_added_bias"};
  other.policy = {{0.1, 0.2}, {{1, 2}, {0.25, 0}}};
  write_flight_log(folder_, other);
  EXPECT_EQ(flightlog::read_flight_log(folder_), other);
  EXPECT_FALSE(fs::exists(folder_ / "power.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "truth.csv"));  // it was another flight's
  EXPECT_FALSE(fs::exists(folder_ / sample_log().header.vehicle));
  EXPECT_EQ(names(), std::vector<std::string>{"flight_1"});
}

TEST_F(FlightLogFolder, IsReplacedUnlessTheSameCommandReadsIt) {
  for (int i = 0; i < 2; ++i) {
    const io::NotedCommand command;
    write_flight_log(folder_, sample_log());
    write_flight_log(folder_, sample_log());
  }
  const io::NotedCommand command;
  io::read_text(folder_ / "mocap.csv");
  EXPECT_EQ(write_message(folder_), folder_.string() +
                                        ": holds mocap.csv, which is read by the same command; accepted: "
                                        "another folder");
  EXPECT_EQ(flightlog::read_flight_log(folder_), sample_log());
}

TEST_F(FlightLogFolder, FollowsALinkToAFolder) {
  fs::create_directory(folder_);
  fs::create_directory_symlink(folder_, root_ / "link");
  write_flight_log(root_ / "link", sample_log());
  EXPECT_TRUE(fs::is_symlink(root_ / "link"));
  EXPECT_EQ(flightlog::read_flight_log(folder_), sample_log());
}

TEST_F(FlightLogFolder, IsNotWrittenOverSomethingElse) {
  const std::string accepted = "; accepted: a new folder, an empty one, or a flight log to replace";
  io::write_atomically(root_ / "file", "x");
  EXPECT_EQ(write_message(root_ / "file"), (root_ / "file").string() + ": is no folder" + accepted);
  fs::create_directory(folder_);
  io::write_atomically(folder_ / "imu.csv", "x");
  EXPECT_EQ(write_message(folder_), folder_.string() + ": holds files, but no flight.toml" + accepted);
  fs::remove(folder_ / "imu.csv");
  write_flight_log(folder_, sample_log());
  io::write_atomically(folder_ / "notes.txt", "x");
  EXPECT_EQ(write_message(folder_),
            folder_.string() + ": holds notes.txt, which is no part of a flight log" + accepted);
  EXPECT_EQ(io::read_text(folder_ / "notes.txt"), "x");
  EXPECT_EQ(write_message(root_ / "file" / "log"),
            (root_ / "file/log").string() + ": cannot be written: Not a directory");
  EXPECT_EQ(names(), (std::vector<std::string>{"file", "flight_1"}));
}

TEST_F(FlightLogFolder, IsNotWrittenWhenItCouldNotBeRead) {
  flightlog::FlightLog log = sample_log();
  log.mocap.t_s[2] = log.mocap.t_s[1];
  EXPECT_EQ(write_message(folder_, log), folder_.string() +
                                             "/mocap.csv:4: t_s: 0.0033333333333333335 does not come after "
                                             "0.0033333333333333335 of the line before; accepted: times that increase");
  log = sample_log();
  log.imu.gyro_x_rad_s[0] = std::nan("");
  EXPECT_EQ(write_message(folder_, log),
            folder_.string() + "/imu.csv:2:3: gyro_x_rad_s: nan is not finite; accepted: a number");
  log = sample_log();
  log.imu.gyro_x_rad_s.pop_back();
  EXPECT_THROW(write_flight_log(folder_, log), std::invalid_argument);
  EXPECT_TRUE(names().empty());
}

TEST_F(FlightLogFolder, NeverOpensTheTruth) {
  write_flight_log(folder_, sample_log());
  fs::create_symlink("truth.csv", folder_ / "truth.csv");  // whoever opens it fails
  EXPECT_EQ(flightlog::read_flight_log(folder_), sample_log());
}

TEST_F(FlightLogFolder, RefusesWhatIsNotThere) {
  EXPECT_EQ(read_message(folder_), folder_.string() + ": cannot be read: No such file or directory");
  EXPECT_EQ(message([&] { flightlog::write_truth(root_, {"t_s"}, {{0}}); }),
            root_.string() + ": is no flight log; accepted: a folder with flight.toml");
  write_flight_log(folder_, sample_log());
  io::write_atomically(folder_ / "notes.csv", "anything");
  EXPECT_EQ(flightlog::read_flight_log(folder_), sample_log());
  fs::rename(folder_ / "power.csv", folder_ / "Power.csv");
  EXPECT_EQ(read_message(folder_), (folder_ / "Power.csv").string() +
                                       ": is no stream of a flight log; accepted: imu.csv, power.csv, wings.csv, "
                                       "attitude.csv, forces.csv, policy.csv; did you mean \"power.csv\"?");
  fs::remove(folder_ / "Power.csv");
  testing::internal::CaptureStderr();
  const flightlog::FlightLog without = flightlog::read_flight_log(folder_);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "warning: " + (folder_ / "flight.toml").string() +
                ": power: is declared, but there is no power.csv: done without\n");
  EXPECT_FALSE(without.power);
  fs::remove(folder_ / "flight.toml");
  EXPECT_EQ(read_message(folder_), (folder_ / "flight.toml").string() + ": cannot be read: No such file or directory");
}

TEST_F(FlightLogFolder, NamesTheFlightsOfAFolderThatIsNone) {
  write_flight_log(root_ / "robot" / "flight_2", sample_log());
  write_flight_log(root_ / "robot" / "flight_1", sample_log());
  const fs::path robot = root_ / "robot";
  EXPECT_EQ(flightlog::flights_in(robot), (std::vector<fs::path>{robot / "flight_1", robot / "flight_2"}));
  EXPECT_EQ(flightlog::flights_in(robot / "flight_1"), std::vector<fs::path>{robot / "flight_1"});
  EXPECT_TRUE(flightlog::flights_in(root_ / "none").empty());
  EXPECT_EQ(message([&] { read_flight_log(robot); }),
            robot.string() + ": is no flight, but a folder of 2; accepted: " + robot.string() + "/*");
}

// Three poses with markers taken for others are left out; a body that is carried elsewhere and stays there is not.
TEST(Readings, LeaveOutSwappedMarkers) {
  FlightLog log = test::some_log(4);
  const std::size_t all = pose_readings(log).size();
  FlightLog swapped = log;
  for (const std::size_t i : {100, 101, 300}) {
    swapped.mocap.qw[i] = 0, swapped.mocap.qx[i] = 1, swapped.mocap.qy[i] = 0, swapped.mocap.qz[i] = 0;
    swapped.mocap.x_m[i] += 0.01;
  }
  EXPECT_EQ(pose_readings(swapped).size(), all - 3);
  FlightLog carried = log;
  for (std::size_t i = 400; i < carried.mocap.x_m.size(); ++i) carried.mocap.x_m[i] += 1;
  EXPECT_EQ(pose_readings(carried).size(), all);
}

// Times of arrival that jitter by a tenth of a period, with gaps, become those of the clock: of a line through n of them, whose ends err by
// 2 / sqrt(n) of the jitter. Times of no clock stay as they are.
TEST(Readings, FindTheClockThatTookTheSamples) {
  FlightLog log = test::some_log(8);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const Column clock = log.mocap.t_s;
  const double period_s = 5e-3, jitter_s = 0.1 * period_s;
  Column kept, truth;
  for (std::size_t i = 0; i < clock.size(); ++i) {
    if (i % 97 < 5) continue;  // lost
    kept.push_back(clock[i] + jitter_s * std::clamp(normal(random), -3.0, 3.0));
    truth.push_back(clock[i]);
  }
  log.mocap.t_s = kept;
  const FlightLog found = on_its_clocks(log);
  ASSERT_EQ(found.mocap.t_s.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i)
    ASSERT_NEAR(found.mocap.t_s[i], truth[i], 5 * jitter_s / std::sqrt(static_cast<double>(truth.size())));
  for (std::size_t i = 0; i < log.mocap.t_s.size(); ++i)  // a rate that changes by 2 %
    log.mocap.t_s[i] = truth[i] + 1e-3 * truth[i] * truth[i];
  EXPECT_EQ(on_its_clocks(log).mocap.t_s, log.mocap.t_s);
}

}  // namespace
}  // namespace flappy::flightlog
