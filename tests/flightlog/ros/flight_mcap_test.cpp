#include "flightlog/ros/flight_mcap.hpp"

#include <gtest/gtest.h>

#include "flightlog/ros/bag.hpp"
#include "flightlog/ros/cdr.hpp"
#include "flightlog/some_log.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::flightlog::ros::flight_mcap_test {
namespace {

struct Seen {
  std::int64_t received_ns;
  Members members;
};

std::map<std::string, std::vector<Seen>> written(const FlightLog& log, const std::vector<Column>& wing_loads = {}) {
  const io::TemporaryFolder folder;
  write_flight_mcap(folder / "f.mcap", log, {}, wing_loads);
  const auto bag = Bag::open(folder / "f.mcap");
  std::map<std::string, std::vector<Seen>> seen;
  std::int64_t last_ns = 0;
  while (const auto m = bag->next()) {
    EXPECT_GE(m->received_ns, last_ns);
    last_ns = m->received_ns;
    seen[m->topic->name].push_back({m->received_ns, decode(*layout_of(*m->topic), m->bytes)});
  }
  EXPECT_TRUE(bag->warnings().empty());
  return seen;
}

double number(const Seen& seen, const std::string& path) { return std::get<double>(seen.members.at(path)); }

std::int64_t stamp_ns(const Seen& seen, const std::string& header = "header") {
  return 1'000'000'000 * std::get<std::int64_t>(seen.members.at(header + ".stamp.sec")) +
         static_cast<std::int64_t>(std::get<std::uint64_t>(seen.members.at(header + ".stamp.nanosec")));
}

// Numbers that tell each member: hundredths of the column, and the row.
TEST(FlightMcap, HasTheLoadsOfTheWings) {
  std::vector<Column> loads(kWingLoadNames.size());
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < loads.size(); ++k)
      loads[k].push_back(k == 0 ? 0.01 * static_cast<double>(i + 1)
                                : static_cast<double>(i) + 0.01 * static_cast<double>(k));
  const auto seen = written(test::some_log(), loads);
  ASSERT_EQ(seen.at("/wing_loads").size(), 3u);
  const Seen& last = seen.at("/wing_loads")[2];
  EXPECT_EQ(stamp_ns(last), 30'000'000);
  EXPECT_EQ(std::get<std::string>(last.members.at("header.frame_id")), "torso");
  EXPECT_EQ(number(last, "left_force_n.x"), 2.01);
  EXPECT_EQ(number(last, "left_moment_nm.z"), 2.06);
  EXPECT_EQ(number(last, "left_lift_n"), 2.07);
  EXPECT_EQ(number(last, "right_force_n.y"), 2.12);
  EXPECT_EQ(number(last, "right_drag_n"), 2.18);
  EXPECT_EQ(number(last, "right_mechanical_power_w"), 2.2);
}

TEST(FlightMcap, HasATopicForEachStream) {
  const FlightLog log = test::some_log();
  const auto seen = written(log);
  const std::map<std::string, std::size_t> expected = {{"/battery", 125}, {"/clock", 100},        {"/imu", 250},
                                                       {"/motors", 125},  {"/joint_states", 250}, {"/pose", 100},
                                                       {"/tf", 100},      {"/wing_input", 500}};
  for (const auto& [topic, count] : expected)
    EXPECT_EQ(seen.contains(topic) ? seen.at(topic).size() : 0, count) << topic;
  EXPECT_EQ(seen.size(), expected.size());

  const Seen& pose = seen.at("/pose")[3];
  EXPECT_EQ(pose.received_ns, 19'000'000);
  EXPECT_EQ(stamp_ns(pose), 15'000'000);  // when it was measured
  EXPECT_EQ(std::get<std::string>(pose.members.at("header.frame_id")), "world");
  EXPECT_EQ(number(pose, "pose.position.y"), log.mocap.y_m[3]);
  EXPECT_EQ(number(pose, "pose.orientation.z"), log.mocap.qz[3]);
  const Seen& tf = seen.at("/tf")[3];
  EXPECT_EQ(stamp_ns(tf, "transforms[0].header"), 15'000'000);
  EXPECT_EQ(std::get<std::string>(tf.members.at("transforms[0].child_frame_id")), "torso");
  EXPECT_EQ(number(tf, "transforms[0].transform.rotation.w"), log.mocap.qw[3]);

  const Seen& imu = seen.at("/imu")[7];
  EXPECT_EQ(stamp_ns(imu), 14'000'000);
  EXPECT_EQ(number(imu, "angular_velocity.z"), log.imu.gyro_z_rad_s[7]);
  EXPECT_EQ(number(imu, "linear_acceleration.x"), log.imu.accel_x_m_s2[7]);
  EXPECT_EQ(number(imu, "orientation_covariance[0]"), -1);
  EXPECT_EQ(number(imu, "angular_velocity_covariance[4]"), 0.0524 * 0.0524);
  EXPECT_EQ(number(imu, "linear_acceleration_covariance[8]"), 0.25);
  EXPECT_EQ(number(imu, "linear_acceleration_covariance[1]"), 0);

  EXPECT_EQ(number(seen.at("/battery")[5], "voltage"), 17.5);
  EXPECT_NEAR(number(seen.at("/battery")[5], "current"), -0.5, 1e-7);
  EXPECT_EQ(number(seen.at("/motors")[5], "effort[1]"), log.power->right_current_A[5]);
  EXPECT_EQ(std::get<std::string>(seen.at("/joint_states")[0].members.at("name[2]")), "right_stroke");
  EXPECT_EQ(number(seen.at("/joint_states")[9], "position[2]"), log.wings->right_stroke_rad[9]);
  EXPECT_EQ(std::get<std::uint64_t>(seen.at("/wing_input")[9].members.at("tick")), 9u);
  EXPECT_EQ(number(seen.at("/wing_input")[9], "left_voltage_v"), log.command.left_voltage_V[9]);
  EXPECT_EQ(number(seen.at("/wing_input")[9], "bias_v"), log.command.inputs->bias_V[9]);
}

TEST(FlightMcap, RefusesAClampedRobot) {
  FlightLog log = test::some_log(0.1);
  log.header.rig.emplace();
  EXPECT_THROW(write_flight_mcap("bench.mcap", log), io::InputError);
}

TEST(FlightMcap, DoesWithoutWhatIsNotLogged) {
  FlightLog log = test::some_log(0.1);
  log.power.reset();
  log.wings.reset();
  log.command.inputs.reset();
  const auto seen = written(log);
  EXPECT_EQ(seen.size(), 5u);
  EXPECT_TRUE(std::isnan(number(seen.at("/wing_input")[0], "amplitude_v")));
}

}  // namespace
}  // namespace flappy::flightlog::ros::flight_mcap_test
