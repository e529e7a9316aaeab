#include "flightlog/import/assemble.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <numbers>

#include "flightlog/import/sources.hpp"
#include "flightlog/import/ulogs.hpp"
#include "flightlog/ros/bag.hpp"
#include "flightlog/ros/flight_mcap.hpp"
#include "flightlog/some_log.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::assemble_test {
namespace {

namespace fs = std::filesystem;
const fs::path kMappings = fs::path(FLAPPY_SOURCE_DIR) / "configs" / "mapping";
using Lines = std::vector<std::string>;

Mapping mapping_of(const std::string& name, const Lines& overrides = {}) {
  return read_mapping(kMappings / name, overrides);
}

/// A log as topics, and back.
Imported there_and_back(const FlightLog& log, const Lines& overrides = {}) {
  const io::TemporaryFolder folder;
  ros::write_flight_mcap(folder / "f.mcap", log);
  const Mapping mapping = mapping_of("ros2.toml", overrides);
  Channels channels(mapping.wanted());
  Lines warnings;
  read_source(folder / "f.mcap", channels, warnings);
  EXPECT_EQ(warnings, Lines());
  return assemble(channels, mapping);
}

void expect_near(const Column& a, const Column& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], tolerance) << i;
}

TEST(Assemble, TakesTheTablesOfAForceSensor) {
  const io::TemporaryFolder folder;
  std::ofstream motors(folder / "motors.csv"), forces(folder / "forces.csv");
  motors << "time,left,right\n";
  forces << "time,Fx,Fy,Fz,Tx,Ty,Tz\n";
  for (int i = 0; i < 200; ++i) {
    motors << 0.005 * i << "," << i % 7 << "," << i % 5 << "\n";
    forces << 0.005 * i << ",0.1,-0.2," << 0.01 * i << ",1,2," << i << "\n";
  }
  motors.close(), forces.close();
  const Mapping mapping = mapping_of("bench.toml");
  const Imported in = import_recording({folder / "motors.csv", folder / "forces.csv"}, mapping, folder / "bench");
  EXPECT_NEAR(in.log.header.rig->rate_hz, 200, 1e-6);
  const FlightLog log = read_flight_log(folder / "bench");
  EXPECT_EQ(log, in.log);
  ASSERT_EQ(log.forces->t_s.size(), 200u);
  EXPECT_DOUBLE_EQ(log.forces->force_z_N[100], 1);
  EXPECT_DOUBLE_EQ(log.forces->moment_z_Nm[100], 0.1);
  EXPECT_NE(
      test::refusal([&] { mapping_of("bench.toml", {"mocap.channel=\"camera\""}); }).find("is of a robot that flies"),
      std::string::npos);
  EXPECT_NE(test::refusal([&] { mapping_of("bench.toml", {"rig.attitude=[1.0, 1.0, 0.0, 0.0]"}); }).find("length 1"),
            std::string::npos);
}

TEST(Import, GivesBackALogThatWasWrittenAsTopics) {
  const FlightLog log = test::some_log();
  // by the times of receipt, which are those of the log
  const Imported back =
      there_and_back(log, {"command.time=received", "command.clock=receiver", "mocap.time=received",
                           "mocap.clock=receiver", "mocap.latency_s=0.004", "imu.time=received", "imu.clock=receiver",
                           "imu.latency_s=0.001", "power.time=received", "power.clock=receiver",
                           "power.latency_s=0.0005", "wings.time=received", "wings.clock=receiver"});
  EXPECT_EQ(back.log.command, log.command);
  EXPECT_EQ(back.log.mocap, log.mocap);
  EXPECT_EQ(back.log.imu, log.imu);
  EXPECT_EQ(back.log.wings, log.wings);
  EXPECT_EQ(back.log.power->t_s, log.power->t_s);
  EXPECT_EQ(back.log.power->left_current_A, log.power->left_current_A);
  expect_near(back.log.power->battery_V, log.power->battery_V, 1e-6);  // a BatteryState has floats
  FlightHeader header = log.header;
  for (double* rate_hz : {&header.mocap.rate_hz, &header.imu.rate_hz, &header.power->rate_hz, &header.wings->rate_hz})
    *rate_hz = 0;
  FlightHeader measured = back.log.header;
  EXPECT_NEAR(measured.mocap.rate_hz, 200, 1e-6);
  EXPECT_NEAR(measured.imu.rate_hz, 500, 1e-6);
  EXPECT_NEAR(measured.power->rate_hz, 250, 1e-6);
  EXPECT_NEAR(measured.wings->rate_hz, 500, 1e-6);
  for (double* rate_hz :
       {&measured.mocap.rate_hz, &measured.imu.rate_hz, &measured.power->rate_hz, &measured.wings->rate_hz})
    *rate_hz = 0;
  header.power->voltage_noise_V = measured.power->voltage_noise_V,
  header.power->current_noise_A = measured.power->current_noise_A;
  EXPECT_EQ(measured, header);
}

TEST(Import, TakesTheInstantsMeasuredFromStamps) {
  const FlightLog log = test::some_log();
  const Imported back = there_and_back(log);
  Column t_s = log.mocap.t_s;
  for (double& t : t_s) t -= log.header.mocap.latency_s;
  expect_near(back.log.mocap.t_s, t_s, 2e-9);
  EXPECT_EQ(back.log.mocap.qz, log.mocap.qz);
  EXPECT_EQ(back.log.command, log.command);
  EXPECT_EQ(back.log.imu.accel_z_m_s2, log.imu.accel_z_m_s2);
  EXPECT_EQ(back.log.power->right_current_A, log.power->right_current_A);
  EXPECT_EQ(back.log.header.mocap.latency_s, 0);
  ASSERT_EQ(back.report.streams.size(), 5u);
  EXPECT_NEAR(back.report.streams[1].delay_median_s, 4e-3, 2e-9);
  for (const StreamReport& s : back.report.streams)
    EXPECT_EQ(s.lost + s.twice + s.late + s.reordered + s.unusable, 0u) << s.stream;
}

TEST(Import, DoesWithoutPowerAndWingsThatAreNotRecorded) {
  FlightLog log = test::some_log();
  log.power.reset();
  log.wings.reset();
  const Imported back = there_and_back(log);
  EXPECT_FALSE(back.log.power || back.log.header.power || back.log.wings || back.log.header.wings);
  EXPECT_EQ(back.report.warnings, (Lines{"power: /battery is not recorded: done without",
                                         "wings: /joint_states is not recorded: done without"}));
}

/// The messages of an MCAP file as one of rosbag2's databases.
void write_database(const fs::path& from, const fs::path& to) {
  std::string topics, messages;
  std::map<std::string, int> ids;
  const auto bag = ros::Bag::open(from);
  while (const auto m = bag->next()) {
    const auto [id, fresh] = ids.try_emplace(m->topic->name, static_cast<int>(ids.size()) + 1);
    const std::string number = std::to_string(id->second);
    if (fresh)
      topics += (topics.empty() ? "" : ",") + std::string("(") + number + ",'" + m->topic->name + "','" +
                m->topic->type + "','cdr','')";
    messages +=
        (messages.empty() ? "" : ",") + std::string("(") + number + "," + std::to_string(m->received_ns) + ",x'";
    for (const char c : m->bytes) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned char>(c));
      messages += digits;
    }
    messages += "')";
  }
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(to.c_str(), &database), SQLITE_OK);
  const std::string statements =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
      "offered_qos_profiles TEXT);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
      "INSERT INTO topics VALUES" +
      topics + "; INSERT INTO messages(topic_id, timestamp, data) VALUES" + messages + ";";
  EXPECT_EQ(sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

TEST(Import, GivesTheSameLogOfADatabase) {
  const io::TemporaryFolder folder;
  ros::write_flight_mcap(folder / "f.mcap", test::some_log(0.1));
  write_database(folder / "f.mcap", folder / "f.db3");
  const Mapping mapping = mapping_of("ros2.toml");
  std::vector<Imported> both;
  for (const char* name : {"f.mcap", "f.db3"}) {
    Channels channels(mapping.wanted());
    Lines warnings;
    read_source(folder / name, channels, warnings);
    EXPECT_EQ(warnings, Lines());
    both.push_back(assemble(channels, mapping));
  }
  EXPECT_EQ(both[0].log.command.t_s.size(), 100u);
  EXPECT_EQ(both[0].log, both[1].log);
}

/// A flight as PX4 would log it: floats, north east down, forward right down, microseconds since the start of the processor.
std::string px4_log(const FlightLog& log) {
  using test::UlogText;
  constexpr double kBoot_us = 5e6;
  const auto t_us = [&](double t_s) { return static_cast<std::uint64_t>(std::llround(kBoot_us + 1e6 * t_s)); };
  const auto floats = [](std::initializer_list<double> values) {
    std::string text;
    for (const double v : values) text += UlogText::bytes(static_cast<float>(v));
    return text;
  };
  UlogText u;
  u.format(
      "actuator_motors:uint64_t timestamp;uint64_t timestamp_sample;float[12] control;uint16_t flags;uint8_t[6] "
      "_padding0;");
  u.format("sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t dt;float[3] accelerometer_m_s2;");
  u.format("battery_status:uint64_t timestamp;float voltage_v;float current_a;");
  u.format("vehicle_visual_odometry:uint64_t timestamp;uint64_t timestamp_sample;float[3] position;float[4] q;");
  u.topic(0, 1, "actuator_motors")
      .topic(0, 2, "sensor_combined")
      .topic(0, 3, "vehicle_visual_odometry")
      .topic(0, 4, "battery_status");
  const CommandStream& c = log.command;
  for (std::size_t i = 0; i < c.t_s.size(); ++i)
    u.data(1, UlogText::bytes(t_us(c.t_s[i])) + UlogText::bytes(std::uint64_t{0}) +
                  floats({c.left_voltage_V[i] / 18, c.right_voltage_V[i] / 18, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}) +
                  std::string(2, '\0'));
  const ImuStream& m = log.imu;
  for (std::size_t i = 0; i < m.t_s.size(); ++i)
    u.data(2, UlogText::bytes(t_us(m.t_s[i])) + floats({m.gyro_x_rad_s[i], -m.gyro_y_rad_s[i], -m.gyro_z_rad_s[i]}) +
                  UlogText::bytes(std::uint32_t{2000}) +
                  floats({m.accel_x_m_s2[i], -m.accel_y_m_s2[i], -m.accel_z_m_s2[i]}));
  const MocapStream& p = log.mocap;
  constexpr double kHalf = std::numbers::sqrt2 / 2;
  for (std::size_t i = 0; i < p.t_s.size(); ++i) {
    // q_NED_FRD = q_NED_ENU q_ENU_FLU q_FLU_FRD, with q_NED_ENU = (0, 1, 1, 0)/sqrt(2) and q_FLU_FRD = (0, 1, 0, 0)
    const double w = -kHalf * (p.qx[i] + p.qy[i]), x = kHalf * (p.qw[i] + p.qz[i]), y = kHalf * (p.qw[i] - p.qz[i]),
                 z = kHalf * (p.qy[i] - p.qx[i]);
    u.data(3, UlogText::bytes(t_us(p.t_s[i])) + UlogText::bytes(t_us(p.t_s[i] - log.header.mocap.latency_s)) +
                  floats({p.y_m[i], p.x_m[i], -p.z_m[i], -x, w, z, -y}));
  }
  for (std::size_t i = 0; i < log.power->t_s.size(); ++i)
    u.data(4, UlogText::bytes(t_us(log.power->t_s[i])) +
                  floats({log.power->battery_V[i], log.power->left_current_A[i] + log.power->right_current_A[i]}));
  return u.text;
}

TEST(Import, GivesBackALogThatPx4Wrote) {
  const io::TemporaryFolder folder;
  const FlightLog log = test::some_log();
  std::ofstream(folder / "f.ulg") << px4_log(log);
  const Mapping mapping = mapping_of("px4.toml");
  Channels channels(mapping.wanted());
  Lines warnings;
  read_source(folder / "f.ulg", channels, warnings);
  EXPECT_EQ(warnings, Lines());
  const FlightLog back = assemble(channels, mapping).log;
  Column measured_s = log.mocap.t_s;
  for (double& t : measured_s) t -= log.header.mocap.latency_s;
  expect_near(back.command.t_s, log.command.t_s, 1e-9);
  expect_near(back.command.right_voltage_V, log.command.right_voltage_V, 1e-5);
  expect_near(back.mocap.t_s, measured_s, 1e-9);
  expect_near(back.mocap.x_m, log.mocap.x_m, 1e-6);
  expect_near(back.mocap.y_m, log.mocap.y_m, 1e-6);
  expect_near(back.mocap.z_m, log.mocap.z_m, 1e-6);
  const double sign = back.mocap.qw[0] * log.mocap.qw[0] < 0 ? -1 : 1;  // either is the same rotation
  for (const auto q : {&MocapStream::qw, &MocapStream::qx, &MocapStream::qy, &MocapStream::qz}) {
    Column turned = back.mocap.*q;
    for (double& value : turned) value *= sign;
    expect_near(turned, log.mocap.*q, 1e-6);
  }
  expect_near(back.imu.gyro_y_rad_s, log.imu.gyro_y_rad_s, 1e-6);
  expect_near(back.imu.accel_z_m_s2, log.imu.accel_z_m_s2, 1e-6);
  expect_near(back.imu.t_s, log.imu.t_s, 1e-9);
  expect_near(back.power->battery_V, log.power->battery_V, 1e-5);
  EXPECT_NEAR(back.power->left_current_A[3], 0.25, 1e-6);
}

// ---- channels that a test, or a recorder, fills itself

constexpr std::int64_t kMs = 1'000'000;

Row imu_row(double gyro_x = 1) {
  return {{"angular_velocity.x", gyro_x}, {"angular_velocity.y", 2},    {"angular_velocity.z", 3},
          {"linear_acceleration.x", 4},   {"linear_acceleration.y", 5}, {"linear_acceleration.z", 6}};
}

/// Two seconds of the three streams that a log needs, by one clock, each received a millisecond later by a clock that is `ahead_ns` of it.
struct Robot {
  std::int64_t ahead_ns = 0;
  Channels channels;

  void add(const std::string& channel, std::int64_t stamp_ns, std::int64_t late_ns, const Row& row) {
    channels.add(channel, stamp_ns + kMs + late_ns + ahead_ns, stamp_ns, row);
  }
  void command(int i, std::int64_t late_ns = 0) {
    add("/wing_input", 1000 * kMs + i * 10 * kMs, late_ns,
        {{"tick", 1.0 * i},
         {"left_voltage_v", 0.01 * i},
         {"right_voltage_v", -0.01 * i},
         {"amplitude_v", 1},
         {"difference_v", 0},
         {"bias_v", 0},
         {"split_cycle", 0},
         {"phase_rad", 0.1 * i}});
  }
  void pose(int i, double x = 1, double qw = 1) {
    add("/pose", 1000 * kMs + i * 10 * kMs, 3 * kMs,
        {{"pose.position.x", x},
         {"pose.position.y", 2},
         {"pose.position.z", 3},
         {"pose.orientation.w", qw},
         {"pose.orientation.x", 0},
         {"pose.orientation.y", 0},
         {"pose.orientation.z", 0}});
  }
  void imu(int i, double gyro_x = 1) { add("/imu", 1000 * kMs + i * 10 * kMs, 0, imu_row(gyro_x)); }
  void fill() {
    for (int i = 0; i < 200; ++i) command(i), pose(i), imu(i);
  }
};

TEST(Import, CountsWhatCameTwiceLateOutOfOrderOrNever) {
  Robot robot;
  for (int i = 0; i < 200; ++i) {
    if (i < 20 || i >= 23) robot.command(i, i == 100 ? 40 * kMs : 0);  // three never, one late
    if (i == 30) robot.command(i);                                     // twice
    if (i != 60) robot.pose(i);
    if (i == 61) robot.pose(60);  // out of order
    robot.imu(i, i == 70 ? std::nan("") : 1);
  }
  const ImportReport report = assemble(robot.channels, mapping_of("ros2.toml")).report;
  const auto& [command, mocap, imu] = std::tie(report.streams[0], report.streams[1], report.streams[2]);
  EXPECT_EQ(command.samples, 197u);
  EXPECT_EQ(command.lost, 3u);
  EXPECT_EQ(command.twice, 1u);
  EXPECT_EQ(command.late, 1u);
  EXPECT_NEAR(command.delay_most_s, 0.04, 1e-9);
  EXPECT_NEAR(command.rate_hz, 100, 1e-9);
  EXPECT_EQ(mocap.samples, 200u);
  EXPECT_EQ(mocap.reordered, 1u);
  EXPECT_EQ(mocap.lost, 0u);
  EXPECT_EQ(mocap.late, 0u);  // its own 3 ms are how long it takes
  EXPECT_NEAR(mocap.delay_median_s, 3e-3, 1e-9);
  EXPECT_EQ(imu.unusable, 1u);
  EXPECT_EQ(imu.lost, 1u);
}

const Lines kAttitudeOfImu = {"attitude.channel=/imu",
                              "attitude.clock=robot",
                              "attitude.latency_s=0.0",
                              "attitude.noise_rad=0.01",
                              "attitude.columns.qw=orientation.w",
                              "attitude.columns.qx=orientation.x",
                              "attitude.columns.qy=orientation.y",
                              "attitude.columns.qz=orientation.z"};

TEST(Import, DoesWithoutAnAttitudeThatIsNotMeasured) {
  const Imported back = there_and_back(test::some_log(), kAttitudeOfImu);
  EXPECT_FALSE(back.log.attitude || back.log.header.attitude);
  EXPECT_EQ(back.report.warnings,
            (Lines{"attitude: /imu has 0 usable samples, 250 that are not (250 orientation.w is not measured, as the "
                   "message says), and 0 at the time of another: done without"}));
  EXPECT_EQ(back.log.imu.t_s.size(), 250u);  // the rate and the force of the same messages
}

TEST(Import, LeavesOutWhatMessagesSayIsNotMeasured) {
  Robot robot;
  for (int i = 0; i < 200; ++i) robot.command(i), robot.pose(i), robot.imu(i, i % 4 == 1 ? kNotMeasured : 1);
  const Imported some = assemble(robot.channels, mapping_of("ros2.toml"));
  EXPECT_EQ(some.report.streams[2].why_unusable,
            (std::map<std::string, std::size_t>{{"angular_velocity.x is not measured, as the message says", 50}}));
  EXPECT_EQ(some.log.imu.t_s.size(), 150u);
  Robot other;
  for (int i = 0; i < 200; ++i) other.command(i), other.pose(i), other.imu(i, kNotMeasured);
  const std::string line = test::refusal([&] { assemble(other.channels, mapping_of("ros2.toml")); });
  EXPECT_TRUE(
      line.ends_with("imu.channel: \"/imu\" has 0 usable samples, 200 that are not (200 angular_velocity.x is "
                     "not measured, as the message says), and 0 at the time of another; accepted: at least 2 "
                     "usable ones"))
      << line;
}

TEST(Import, PutsTheTimesOfAllStreamsInOrder) {
  Robot robot;
  for (int i = 199; i >= 0; --i) robot.command(i), robot.pose(i, i), robot.imu(i, i);
  const FlightLog log = assemble(robot.channels, mapping_of("ros2.toml")).log;
  EXPECT_TRUE(std::ranges::is_sorted(log.mocap.t_s));
  EXPECT_EQ(log.mocap.x_m[150], 150);
  EXPECT_EQ(log.mocap.t_s.front(), 0);
  EXPECT_EQ(log.imu.t_s[100], 1);
}

TEST(Import, MeasuresAClock) {
  Robot robot{1'760'000'000'000'000'123, Channels()};
  robot.fill();
  const Imported out = assemble(robot.channels, mapping_of("ros2.toml"));
  ASSERT_EQ(out.report.clocks.size(), 1u);
  EXPECT_EQ(out.report.clocks[0].name, "robot");
  EXPECT_EQ(out.report.clocks[0].stamps, 600u);
  EXPECT_NEAR(out.report.clocks[0].offset_s, 1'760'000'000.001, 1e-6);
  EXPECT_EQ(out.report.start_ns, 1'760'000'000'000'000'123 + 1001 * kMs);
  EXPECT_EQ(out.log.mocap.t_s[100], 1);
  // two streams by stamps and one by times of receipt, a millisecond after its stamps as the quickest are
  const FlightLog mixed =
      assemble(robot.channels, mapping_of("ros2.toml", {"imu.time=received", "imu.clock=receiver"})).log;
  EXPECT_EQ(mixed.imu.t_s[100], 1);
}

TEST(Import, TakesAnOffsetThatIsGiven) {
  Robot robot{5'000 * kMs, Channels()};
  robot.fill();
  const Imported out = assemble(robot.channels, mapping_of("ros2.toml", {"clocks.robot.offset_s=4.5", "start=clock"}));
  EXPECT_FALSE(out.report.clocks[0].measured);
  EXPECT_EQ(out.log.imu.t_s.front(), 5.5);
  EXPECT_EQ(out.report.start_ns, 0);
}

TEST(Import, ScalesAndHoldsColumnsOfAnotherChannel) {
  Robot robot;
  robot.fill();
  robot.add("/motors", 1004 * kMs, 0, {{"effort[left_motor]", 1}, {"effort[right_motor]", 3}});
  robot.add("/motors", 1500 * kMs, 0, {{"effort[left_motor]", 2}, {"effort[right_motor]", 4}});
  for (int i = 0; i < 200; ++i) robot.add("/battery", 1000 * kMs + i * 10 * kMs, 0, {{"voltage", 9}});
  const Imported out = assemble(
      robot.channels, mapping_of("ros2.toml", {"power.scale.left_current_A=-10", "power.offset.left_current_A=0.5"}));
  EXPECT_EQ(out.report.streams[3].unusable, 1u);  // before the first current
  EXPECT_EQ(out.log.power->left_current_A.front(), -9.5);
  EXPECT_EQ(out.log.power->left_current_A.back(), -19.5);
  EXPECT_EQ(out.log.power->right_current_A[48], 3);  // at 490 ms
  EXPECT_EQ(out.log.power->right_current_A[49], 4);
}

TEST(Import, TurnsNorthEastDownIntoEastNorthUp) {
  Robot robot;
  // half a right angle to the right of north, the nose up by 30 degrees, as PX4 has it
  const double yaw = std::numbers::pi / 4, pitch = std::numbers::pi / 6;
  const double w = std::cos(yaw / 2) * std::cos(pitch / 2), x = -std::sin(yaw / 2) * std::sin(pitch / 2),
               y = std::cos(yaw / 2) * std::sin(pitch / 2), z = std::sin(yaw / 2) * std::cos(pitch / 2);
  for (int i = 0; i < 3; ++i) {
    robot.command(i), robot.imu(i);
    robot.add("/pose", 1000 * kMs + i * 10 * kMs, 0,
              {{"pose.position.x", 10},
               {"pose.position.y", 20},
               {"pose.position.z", -30},
               {"pose.orientation.w", w},
               {"pose.orientation.x", x},
               {"pose.orientation.y", y},
               {"pose.orientation.z", z}});
  }
  const FlightLog log =
      assemble(robot.channels, mapping_of("ros2.toml", {"mocap.world=ned", "mocap.frame=frd", "imu.frame=frd"})).log;
  EXPECT_EQ(log.mocap.x_m[0], 20);
  EXPECT_EQ(log.mocap.y_m[0], 10);
  EXPECT_EQ(log.mocap.z_m[0], 30);
  const double qw = log.mocap.qw[0], qx = log.mocap.qx[0], qy = log.mocap.qy[0], qz = log.mocap.qz[0];
  // where forward and up point: north-east and up by 30 degrees
  EXPECT_NEAR(1 - 2 * (qy * qy + qz * qz), std::cos(pitch) * std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(2 * (qx * qy + qw * qz), std::cos(pitch) * std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(2 * (qx * qz - qw * qy), std::sin(pitch), 1e-12);
  EXPECT_NEAR(1 - 2 * (qx * qx + qy * qy), std::cos(pitch), 1e-12);
  EXPECT_EQ(log.imu.gyro_x_rad_s[0], 1);
  EXPECT_EQ(log.imu.gyro_y_rad_s[0], -2);
  EXPECT_EQ(log.imu.accel_z_m_s2[0], -6);

  const FlightLog x_north =
      assemble(robot.channels, mapping_of("ros2.toml", {"mocap.world=ned_x_north", "mocap.frame=frd"})).log;
  EXPECT_EQ(x_north.mocap.x_m[0], 10);
  EXPECT_EQ(x_north.mocap.y_m[0], -20);
  EXPECT_EQ(x_north.mocap.z_m[0], 30);
  EXPECT_NEAR(x_north.mocap.qw[0], w, 1e-15);
  EXPECT_NEAR(x_north.mocap.qx[0], x, 1e-15);
  EXPECT_NEAR(x_north.mocap.qy[0], -y, 1e-15);
  EXPECT_NEAR(x_north.mocap.qz[0], -z, 1e-15);
}

TEST(Import, LeavesOutPosesThatAreNone) {
  Robot robot;
  robot.fill();
  robot.pose(200, 1, 0);
  const Imported out = assemble(robot.channels, mapping_of("ros2.toml"));
  EXPECT_EQ(out.report.streams[1].unusable, 1u);
  EXPECT_EQ(out.log.mocap.t_s.size(), 200u);
}

// ---- times that no clock of the flight showed

std::map<std::string, std::size_t> why(const Imported& out, std::size_t stream) {
  return out.report.streams[stream].why_unusable;
}

TEST(Import, LeavesOutTimesApartFromTheRecording) {
  for (const std::int64_t wild_ns : {std::int64_t{0}, std::int64_t{-5}, std::int64_t{3'000'000'000'000'000'000}}) {
    Robot robot{1'700'000'000'000 * kMs, Channels()};
    robot.command(0);
    robot.channels.add("/imu", wild_ns, wild_ns, imu_row());
    robot.fill();
    for (const char* time : {"stamp", "received"}) {
      if (std::string(time) == "stamp" && wild_ns < kMs) continue;  // the robot's own clock began just before
      const bool received = std::string(time) == "received";
      const Imported out =
          assemble(robot.channels, mapping_of("ros2.toml", {"imu.time=" + std::string(time),
                                                            received ? "imu.clock=receiver" : "imu.clock=robot"}));
      EXPECT_EQ(why(out, 2), (std::map<std::string, std::size_t>{{"apart from the rest of the recording", 1}}))
          << time << wild_ns;
      EXPECT_EQ(out.log.imu.t_s.size(), 200u);
      EXPECT_NEAR(out.log.imu.t_s.back(), 1.99, 2e-3);
      EXPECT_EQ(out.report.warnings.at(0), "imu: 1 samples are unusable: 1 apart from the rest of the recording");
    }
  }
}

TEST(Import, MeasuresAClockInSpiteOfAWildTimeOfReceipt) {
  Robot robot{5'000 * kMs, Channels()};
  robot.fill();
  robot.add("/imu", 1995 * kMs, -7'000'000'000 * kMs, imu_row());
  const Imported out = assemble(robot.channels, mapping_of("ros2.toml"));
  EXPECT_NEAR(out.report.clocks[0].offset_s, 5.001, 1e-6);
  EXPECT_EQ(out.log.imu.t_s.size(), 201u);  // its stamp is right
  EXPECT_NEAR(out.report.streams[2].delay_most_s, 0, 1e-9);
}

TEST(Import, RefusesAStreamOfAnotherTime) {
  Robot robot;
  for (int i = 0; i < 200; ++i) {
    robot.command(i), robot.pose(i);
    robot.channels.add("/imu", 0, 1'700'000'000'000 * kMs + i * 10 * kMs, imu_row());
  }
  const std::string line =
      test::refusal([&] { assemble(robot.channels, mapping_of("ros2.toml", {"clocks.robot.offset_s=0"})); });
  EXPECT_NE(line.find("imu.clock: \"/imu\" was recorded 1.7e+09 s from the others; accepted: "), std::string::npos)
      << line;
}

// ---- tables: rows of one channel, by a field

Imported of_table(const Lines& rows, const Lines& overrides = {}) {
  const io::TemporaryFolder folder;
  std::ofstream file(folder / "log.csv");
  file << "t,u,x,y,z,qw,qx,qy,qz\n";
  for (const std::string& row : rows) file << row << "\n";
  file.close();
  std::ofstream(folder / "mapping.toml") << R"(schema = 1
vehicle = "crazyflie.toml"
gravity_m_s2 = 9.81
ambient = { air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }
[command]
channel = "*"
time = "field"
time_field = "t"
inputs = ["u"]
columns = { u = "u" }
[mocap]
channel = "*"
time = "field"
time_field = "t"
latency_s = 0.0
position_noise_m = 1e-4
attitude_noise_rad = 5e-3
columns = { x_m = "x", y_m = "y", z_m = "z", qw = "qw", qx = "qx", qy = "qy", qz = "qz" }
)";
  const Mapping mapping = read_mapping(folder / "mapping.toml", overrides);
  Channels channels(mapping.wanted());
  Lines warnings;
  read_source(folder / "log.csv", channels, warnings);
  return assemble(channels, mapping);
}

/// Twenty rows, 10 ms apart in seconds.
Lines some_rows(double from_s = 0) {
  Lines rows;
  for (int i = 0; i < 20; ++i) rows.push_back(io::shortest_digits(from_s + 0.01 * i) + ",9,0.1,0.2,1,1,0,0,0");
  return rows;
}

TEST(Import, SaysWhySamplesAreUnusable) {
  Lines rows = some_rows();
  rows[3] = "0.03,inf,0.1,0.2,1,1,0,0,0";
  rows[4] = "0.04,NA,0.1,0.2,1,1,0,0,0";
  rows[5] = "0.05,9,,0.2,1,1,0,0,0";
  rows[6] = "none,9,0.1,0.2,1,1,0,0,0";
  rows[7] = "0.07,9,0.1,0.2,1,0.5,0,0,0";
  const Imported out = of_table(rows);
  using Why = std::map<std::string, std::size_t>;
  EXPECT_EQ(why(out, 0), (Why{{"u is no finite number", 1}, {"lacks u", 1}, {"no time", 1}}));
  EXPECT_EQ(why(out, 1), (Why{{"lacks x_m", 1}, {"no time", 1}, {"quaternion of another length than 1", 1}}));
  EXPECT_EQ(out.report.warnings[0], "command: 3 samples are unusable: 1 lacks u, 1 no time, 1 u is no finite number");
}

TEST(Import, LeavesOutANumberThatNoLogMayHave) {
  Lines rows;
  for (int i = 0; i < 200; ++i) rows.push_back(io::shortest_digits(0.01 * i) + ",9,0.1,0.2,1,1,0,0,0");
  rows[7] = "0.07,9,-3e22,0.2,1,1,0,0,0";
  EXPECT_EQ(why(of_table(rows), 1), (std::map<std::string, std::size_t>{{"x_m is out of range", 1}}));
  rows[8] = rows[9] = "0.08,9,-3e22,0.2,1,1,0,0,0";  // too often for flipped bits
  const std::string line = test::refusal([&] { of_table(rows); });
  EXPECT_TRUE(
      line.ends_with("mocap.columns.x_m: reaches -3e+22: in another unit?; accepted: numbers from -1e+06 to 1e+06"))
      << line;
}

TEST(Import, TakesRowsThatHaveNothingOfAStreamForOthers) {
  Lines rows = some_rows();
  for (std::size_t i = 0; i < rows.size(); i += 2) rows[i] = rows[i].substr(0, rows[i].find(',')) + ",9,,,,,,,";
  const Imported out = of_table(rows);
  EXPECT_EQ(out.report.streams[0].samples, 20u);
  EXPECT_EQ(out.report.streams[1].samples, 10u);
  EXPECT_EQ(out.report.streams[1].unusable, 0u);
}

TEST(Import, NamesTheUnitOfTimesThatAreNoSeconds) {
  const auto refused = [](const Lines& rows, const Lines& overrides = {}) {
    const std::string line = test::refusal([&] { of_table(rows, overrides); });
    return line.substr(std::min(line.size(), line.find("command.")));
  };
  Lines rows;
  for (int i = 0; i < 20; ++i)
    rows.push_back(std::to_string(1'700'000'000'000'000 + 10'000 * i) + ",9,0.1,0.2,1,1,0,0,0");
  EXPECT_EQ(refused(rows), "command.time_unit: times of \"t\" reach 1.7e+15 s; accepted: time_unit = \"us\"");
  for (int i = 0; i < 20; ++i) rows[i] = std::to_string(10'000 * i) + ",9,0.1,0.2,1,1,0,0,0";
  EXPECT_EQ(refused(rows), "command.time_unit: samples are 1e+04 s apart by \"t\"; accepted: time_unit = \"us\"");
  EXPECT_EQ(refused(some_rows(), {"command.time_unit=ns"}),
            "command.time_unit=ns: command.time_unit: samples are 1e-11 s apart by \"t\"; accepted: time_unit = \"s\"");
}

TEST(Import, DoesWithoutPowerThatWasAnnouncedAndNeverCame) {
  Robot robot;
  robot.fill();
  robot.channels.add("/battery");
  const Imported out = assemble(robot.channels, mapping_of("ros2.toml"));
  EXPECT_FALSE(out.log.power || out.log.header.power);
  EXPECT_EQ(out.report.warnings[0], "power: /battery has no samples: done without");
}

TEST(Import, RefusesWhatIsNotThere) {
  Robot robot;
  robot.fill();
  const auto refused = [&](const Lines& overrides) {
    const std::string line = test::refusal([&] { assemble(robot.channels, mapping_of("ros2.toml", overrides)); });
    const std::string place = (kMappings / "ros2.toml").string();
    return line.starts_with(place) ? line.substr(place.size()) : line;
  };
  EXPECT_EQ(refused({"mocap.channel=/posee"}).substr(0, 200),
            "--set mocap.channel=/posee: mocap.channel: \"/posee\" is not recorded; accepted: /imu, /pose, "
            "/wing_input; did you mean \"/pose\"?");
  EXPECT_EQ(refused({"imu.columns.gyro_x_rad_s=angular_velocity.xx"}),
            "--set imu.columns.gyro_x_rad_s=angular_velocity.xx: imu.columns.gyro_x_rad_s: \"angular_velocity.xx\" is "
            "no field of the "
            "channel; accepted: angular_velocity.x, angular_velocity.y, angular_velocity.z, linear_acceleration.x, "
            "linear_acceleration.y, linear_acceleration.z; did you mean \"angular_velocity.x\"?");
  robot.channels.add("/none");
  EXPECT_EQ(refused({"mocap.channel=/none"}),
            "--set mocap.channel=/none: mocap.channel: \"/none\" has no samples; accepted: a channel that has some: "
            "/imu, /pose, /wing_input");
}

TEST(Import, RefusesAChannelWithoutSamplesToUse) {
  Robot robot;
  for (int i = 0; i < 200; ++i) robot.command(i), robot.pose(0), robot.imu(i);
  robot.pose(7, std::nan(""));
  const std::string line = test::refusal([&] { assemble(robot.channels, mapping_of("ros2.toml")); });
  EXPECT_TRUE(
      line.ends_with("ros2.toml:28:11: mocap.channel: \"/pose\" has 1 usable samples, 1 that are not (1 lacks x_m), "
                     "and 199 at the time of "
                     "another; accepted: at least 2 usable ones"))
      << line;
}

TEST(Import, RefusesTimesThatCannotBeHad) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "motors.csv") << "time_us,left_V,right_V\n0,1,2\n1000,1,2\n";
  std::ofstream(folder / "mocap.csv") << "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n0.001,1,2,3,1,0,0,0\n";
  std::ofstream(folder / "imu.csv")
      << "time_us,gx_deg_s,gy_deg_s,gz_deg_s,ax_g,ay_g,az_g\n0,180,0,0,0,0,1\n2000,180,0,0,0,0,1\n";
  const auto imported = [&](const Lines& overrides, bool with_offset = true) {
    std::string text = io::read_text(kMappings / "csv.toml");
    if (!with_offset) text.erase(text.find("offset_s = 0.0"), 14);
    std::ofstream(folder / "m.toml") << text;
    const Mapping mapping = read_mapping(folder / "m.toml", overrides);
    Channels channels(mapping.wanted());
    Lines warnings;
    for (const char* name : {"motors.csv", "mocap.csv", "imu.csv"}) read_source(folder / name, channels, warnings);
    return assemble(channels, mapping);
  };
  const FlightLog log = imported({"clocks.camera.offset_s=0.0005"}).log;
  EXPECT_EQ(log.mocap.t_s, (Column{0.0005, 0.0015}));
  EXPECT_DOUBLE_EQ(log.mocap.z_m[0], 3e-3);
  EXPECT_DOUBLE_EQ(log.imu.gyro_x_rad_s[0], std::numbers::pi);
  EXPECT_DOUBLE_EQ(log.imu.accel_z_m_s2[0], 9.80665);
  EXPECT_EQ(log.imu.t_s, (Column{0, 0.002}));
  const std::string at = (folder / "m.toml").string();
  EXPECT_EQ(test::refusal([&] { imported({}, false); }),
            at + ":30:9: mocap.clock: \"camera\" cannot be measured: no sample says when it was received; accepted: "
                 "clocks.camera.offset_s");
  const auto refused = [&](const std::string& text) {
    std::string mapping = io::read_text(kMappings / "csv.toml");
    const std::string old = "time = \"field\"\ntime_field = \"time_us\"\ntime_unit = \"us\"\n";
    mapping.replace(mapping.find(old), old.size(), text);
    std::ofstream(folder / "other.toml") << mapping;
    const Mapping read = read_mapping(folder / "other.toml");
    Channels channels(read.wanted());
    Lines warnings;
    for (const char* name : {"motors.csv", "mocap.csv", "imu.csv"}) read_source(folder / name, channels, warnings);
    const std::string line = test::refusal([&] { assemble(channels, read); });
    return line.substr(folder.path().string().size() + 1);
  };
  EXPECT_EQ(
      refused(""),
      "other.toml:17:1: command.time: samples of this channel have no stamp; accepted: \"received\", or \"field\" "
      "with time_field");
  EXPECT_EQ(refused("time = \"received\"\n"),
            "other.toml:19:8: command.time: samples of this channel do not say when they were received; accepted: "
            "\"stamp\", or "
            "\"field\" with time_field");
}

TEST(Import, ReportsInLines) {
  Robot robot{2 * kMs, Channels()};
  robot.fill();
  const std::string text = report_text(assemble(robot.channels, mapping_of("ros2.toml")).report);
  EXPECT_NE(
      text.find("  mocap          200    100.00      0      0      0      0        0         3.000    3.000  /pose\n"),
      std::string::npos)
      << text;
  EXPECT_NE(
      text.find(
          "  clock robot: the receiver's is ahead by 0.003000 s, drifting by 0.0 us/s, by 600 stamps over 2.0 s\n"),
      std::string::npos)
      << text;
}

/// One table of a robot that is known by its inputs, as its logger wrote it: it stands, flies from 0.10 s to 0.30 s, and stands.
std::string table_of_inputs(int rows = 40) {
  std::string text =
      "timeTick, roll, pitch, yaw, accX, accY, accZ, m1, m2, m3, m4, thrust, vbat, otX0, otY0, otZ0, otRoll0, "
      "otPitch0, "
      "otYaw0\n";
  for (int i = 0; i < rows; ++i) {
    const bool flies = i >= 10 && i <= 30;
    const std::string lost = i == 20 ? "nan" : "0.5";
    text += std::to_string(5000 + 10 * i) + ", 0, 90, 0, 0, 0, 1, 65535, 0, 0, 6553.5, " + (flies ? "9" : "0") +
            ", 8, " + lost + ", " + std::to_string(i) + ", 1, 0, 0, 90\n";
  }
  return text;
}

TEST(Import, LeavesOutAnAngleOfFlippedBits) {
  const io::TemporaryFolder folder;
  std::string text = table_of_inputs(200);
  text.replace(text.find("5200, 0, 90"), 11, "5200, 0, 1e9");
  std::ofstream(folder / "flight.csv") << text;
  const Mapping mapping = mapping_of("flapper_nimble.toml", {});
  Channels channels(mapping.wanted());
  Lines warnings;
  read_source(folder / "flight.csv", channels, warnings);
  const Imported out = assemble(channels, mapping);
  EXPECT_EQ(out.log.attitude->t_s.size(), 20u);
}

TEST(Import, MakesALogOfInputs) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "flight.csv") << table_of_inputs();
  const auto imported = [&](const Lines& overrides) {
    const Mapping mapping = mapping_of("flapper_nimble.toml", overrides);
    Channels channels(mapping.wanted());
    Lines warnings;
    read_source(folder / "flight.csv", channels, warnings);
    return assemble(channels, mapping);
  };
  const Imported out = imported({});
  const FlightLog& log = out.log;
  EXPECT_EQ(log.header.inputs, (Lines{"left_flap", "right_flap", "pitch_servo", "yaw_servo"}));
  ASSERT_EQ(log.command.declared.size(), 4u);
  EXPECT_EQ(log.command.t_s.size(), 21u);
  EXPECT_EQ(log.command.t_s.front(), 0);
  EXPECT_EQ(log.command.t_s.back(), 0.2);
  EXPECT_DOUBLE_EQ(log.command.declared[0][5], 1);
  EXPECT_DOUBLE_EQ(log.command.declared[1][5], 0.1);
  EXPECT_TRUE(log.command.left_voltage_V.empty());
  // A cell that is no number is a sample that is not there.
  EXPECT_EQ(log.mocap.t_s.size(), 20u);
  EXPECT_EQ(out.report.streams[1].unusable, 1u);
  EXPECT_EQ(out.report.streams[1].lost, 1u);
  EXPECT_EQ(log.mocap.y_m.front(), 10);
  EXPECT_NEAR(log.header.mocap.rate_hz, 100, 1e-9);
  // A yaw of 90 degrees turns x to y. A pitch of 90 degrees nose up turns x to z: about -y.
  const double half = std::numbers::sqrt2 / 2;
  EXPECT_NEAR(log.mocap.qw[3], half, 1e-12);
  EXPECT_NEAR(log.mocap.qz[3], half, 1e-12);
  EXPECT_NEAR(log.attitude->qw[3], half, 1e-12);
  EXPECT_NEAR(log.attitude->qy[3], -half, 1e-12);
  EXPECT_TRUE(log.imu.gyro_x_rad_s.empty());
  EXPECT_DOUBLE_EQ(log.imu.accel_z_m_s2[0], 9.81);
  EXPECT_TRUE(log.power->left_current_A.empty());
  EXPECT_EQ(flightlog::parse_flight_log(flight_log_files(log), "log"), log);

  const std::string mapping = (kMappings / "flapper_nimble.toml").string();
  EXPECT_EQ(test::refusal([&] { imported({"command.flown.above=9"}); }),
            "--set command.flown.above=9: command.flown.above: \"thrust\" is never above it; accepted: what it exceeds "
            "while the robot flies");
  EXPECT_EQ(test::refusal([&] { imported({"attitude.scale.pitch_rad=-1"}); }),
            mapping +
                ":95:13: attitude.columns.pitch_rad: reaches -90: likely in degrees; accepted: radians: "
                "attitude.scale.pitch_rad = 0.017453292519943295");
  EXPECT_EQ(test::refusal([&] { imported({"imu.channel=flights"}); }),
            "--set imu.channel=flights: imu.channel: \"flights\" is not recorded; accepted: flight; did you mean "
            "\"flight\"?");
}

/// A log of the microSD card: it flies from 0.10 s to 0.30 s, leaning forwards by 0.1 rad at a yaw of 90 degrees.
std::string card_log() {
  const auto bytes = [](auto value) { return test::UlogText::bytes(value); };
  std::string text = "\xBC" + bytes(std::uint16_t{2}) + bytes(std::uint16_t{1}) + bytes(std::uint16_t{0}) +
                     "fixedFrequency" + '\0' + bytes(std::uint16_t{13});
  for (const char* name :
       {"motor.m1(I)", "motor.m2(I)", "motor.m3(I)", "motor.m4(I)", "pm.vbatMV(H)", "stateEstimate.x(f)",
        "stateEstimate.y(f)", "stateEstimate.z(f)", "stateEstimate.ax(f)", "stateEstimate.ay(f)", "stateEstimate.az(f)",
        "stateEstimate.roll(f)", "stateEstimate.yaw(f)"})
    text += name + std::string(1, '\0');
  for (int i = 0; i < 40; ++i) {
    const bool flies = i >= 10 && i <= 30;
    text += bytes(std::uint16_t{0}) + bytes(static_cast<std::uint64_t>(5'000'000 + 10'000 * i));
    for (int m = 0; m < 4; ++m) text += bytes(std::uint32_t{flies ? 65535u / (m + 1) : 0u});
    text += bytes(std::uint16_t{3700});
    // at a yaw of 90 degrees the force along y is forwards
    for (const float x : {0.5f, 0.0f, 1.0f, 0.0f, std::tan(0.1f), 0.0f, 0.0f, 90.0f}) text += bytes(x);
  }
  return text;
}

TEST(Import, DerivesThePitchThatACardLogLacks) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "log00") << card_log();
  const auto imported = [&](const Lines& overrides) {
    const Mapping mapping = mapping_of("crazyflie_sd.toml", overrides);
    Channels channels(mapping.wanted());
    Lines warnings;
    read_source(folder / "log00", channels, warnings);
    return assemble(channels, mapping).log;
  };
  const FlightLog log = imported({});
  EXPECT_EQ(log.header.mocap.source, PoseSource::estimate_without_pitch);
  ASSERT_EQ(log.mocap.t_s.size(), 21u);
  EXPECT_DOUBLE_EQ(log.command.declared[1][5], 32767 * 1.5259021896696422e-05);
  EXPECT_DOUBLE_EQ(log.power->battery_V[5], 3.7);
  // turned by the yaw, then by 0.1 rad about y
  const double half = std::numbers::sqrt2 / 2;
  EXPECT_NEAR(log.mocap.qw[3], half * std::cos(0.05), 1e-6);
  EXPECT_NEAR(log.mocap.qx[3], -half * std::sin(0.05), 1e-6);
  EXPECT_NEAR(log.mocap.qy[3], half * std::sin(0.05), 1e-6);
  EXPECT_NEAR(log.mocap.qz[3], half * std::cos(0.05), 1e-6);
  EXPECT_EQ(parse_flight_log(flight_log_files(log), "log"), log);
  EXPECT_NE(test::refusal([&] { imported({"mocap.source=guess"}); }).find("accepted: "), std::string::npos);
  EXPECT_NE(test::refusal([&] { imported({"mocap.source=estimate"}); }).find("mocap.columns"), std::string::npos);
}

TEST(Import, AnEstimateIsTooCoarseForVoltages) {
  EXPECT_NE(test::refusal([&] {
              mapping_of("ros2.toml", {"mocap.source=estimate"});
            }).find("is too coarse for motion within a wing beat; accepted: \"motion_capture\""),
            std::string::npos);
}

/// Yaw, then pitch about the new y, then roll about the new x, worked out by hand for yaw 90, roll 90: x goes to y, y to z, z to x.
TEST(Import, TurnsAnglesInTheirOrder) {
  const io::TemporaryFolder folder;
  std::string text = table_of_inputs();
  for (std::size_t at = 0; (at = text.find("1, 0, 0, 90\n", at)) != std::string::npos;)
    text.replace(at, 11, "1, 90, 0, 90");
  std::ofstream(folder / "flight.csv") << text;
  const Mapping mapping = mapping_of("flapper_nimble.toml");
  Channels channels(mapping.wanted());
  Lines warnings;
  read_source(folder / "flight.csv", channels, warnings);
  const MocapStream m = assemble(channels, mapping).log.mocap;
  for (const Column* component : {&m.qw, &m.qx, &m.qy, &m.qz}) EXPECT_NEAR(component->front(), 0.5, 1e-12);
}

}  // namespace
}  // namespace flappy::flightlog::assemble_test
