#include "flightlog/import/message_rows.hpp"

#include <gtest/gtest.h>

#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/ros_messages.hpp"

namespace flappy::flightlog {
namespace {

using ros::Members;
using ros::standard_messages;

std::map<std::string, double> row_of(const char* type, const Members& members, std::int64_t* stamp_ns = nullptr) {
  MessageRows rows(standard_messages().layout(type));
  std::map<std::string, double> row;
  for (const Item& item : rows.read(encode(*standard_messages().layout(type), members))) row[item.name] = item.value;
  if (stamp_ns) *stamp_ns = rows.stamp_ns();
  return row;
}

TEST(MessageRows, NamesJoints) {
  std::int64_t stamp_ns = 0;
  const auto row = row_of("sensor_msgs/JointState",
                          {{"header.stamp.sec", std::int64_t{3}},
                           {"header.stamp.nanosec", std::int64_t{5}},
                           {"name[0]", "right"},
                           {"name[1]", "left"},
                           {"position[0]", 1.0},
                           {"position[1]", 2.0},
                           {"position[2]", 3.0},
                           {"effort[0]", 4.0}},
                          &stamp_ns);
  EXPECT_EQ(stamp_ns, 3'000'000'005);
  EXPECT_EQ(row, (std::map<std::string, double>{{"header.stamp.sec", 3},
                                                {"header.stamp.nanosec", 5},
                                                {"position[right]", 1},
                                                {"position[left]", 2},
                                                {"position[2]", 3},
                                                {"effort[right]", 4}}));
}

TEST(MessageRows, NamesTransforms) {
  const auto row = row_of("tf2_msgs/TFMessage", {{"transforms[0].child_frame_id", "room"},
                                                 {"transforms[1].child_frame_id", "torso"},
                                                 {"transforms[1].transform.translation.x", 7.0}});
  EXPECT_EQ(row.at("transforms[torso].transform.translation.x"), 7);
  EXPECT_EQ(row.at("transforms[room].transform.translation.x"), 0);
}

TEST(MessageRows, LeavesOtherIndicesAndHasNoStampWhereThereIsNone) {
  std::int64_t stamp_ns = 0;
  const auto row = row_of("std_msgs/Float64MultiArray", {{"data[0]", 1.5}, {"data[1]", 2.5}}, &stamp_ns);
  EXPECT_EQ(row.at("data[1]"), 2.5);
  EXPECT_EQ(stamp_ns, kNoTime);
  EXPECT_TRUE(row_of("sensor_msgs/Imu", {}).contains("angular_velocity_covariance[4]"));
}

TEST(MessageRows, MarkWhatAnImuDoesNotMeasure) {
  const auto row = row_of("sensor_msgs/Imu", {{"orientation.w", 1.0},
                                              {"orientation_covariance[0]", -1.0},
                                              {"angular_velocity.x", 0.5},
                                              {"linear_acceleration.z", 9.81},
                                              {"linear_acceleration_covariance[0]", 0.25}});
  for (const char* field : {"orientation.w", "orientation.x", "orientation.y", "orientation.z"})
    EXPECT_TRUE(is_not_measured(row.at(field))) << field;
  EXPECT_EQ(row.at("orientation_covariance[0]"), -1);
  EXPECT_EQ(row.at("angular_velocity.x"), 0.5);  // a covariance of 0 is unknown
  EXPECT_EQ(row.at("linear_acceleration.z"), 9.81);
  const auto still = row_of("sensor_msgs/Imu", {{"angular_velocity_covariance[0]", -1.0}});
  EXPECT_TRUE(is_not_measured(still.at("angular_velocity.y")));
  EXPECT_EQ(still.at("linear_acceleration.y"), 0);
  EXPECT_EQ(still.at("orientation.x"), 0);
}

/// The names of what a message of this type says is not measured.
std::vector<std::string> marked(const char* type, Row row) {
  NotMeasured(type).mark(row);
  std::vector<std::string> names;
  for (const Item& item : row)
    if (is_not_measured(item.value)) names.push_back(item.name);
  return names;
}

TEST(NotMeasured, KnowsWhatOtherMessagesSay) {
  using Names = std::vector<std::string>;
  for (const char* type : {"sensor_combined", "px4_msgs/msg/SensorCombined"}) {
    EXPECT_EQ(
        marked(type,
               {{"gyro_rad[0]", 1}, {"accelerometer_timestamp_relative", 2147483647.0}, {"accelerometer_m_s2[2]", 3}}),
        Names{"accelerometer_m_s2[2]"});
    EXPECT_EQ(marked(type, {{"accelerometer_timestamp_relative", 0}, {"accelerometer_m_s2[2]", 3}}), Names());
  }
  const Row place = {{"xy_valid", 0}, {"z_valid", 1}, {"v_z_valid", 0}, {"x", 1},
                     {"y", 2},        {"z", 3},       {"vx", 4},        {"vz", 5}};
  EXPECT_EQ(marked("vehicle_local_position", place), (Names{"x", "y", "vz"}));
  EXPECT_EQ(marked("px4_msgs/msg/VehicleLocalPosition", place), (Names{"x", "y", "vz"}));
  EXPECT_EQ(marked("own_msgs/msg/Place", place), Names());
  EXPECT_EQ(marked("battery_status", {{"voltage_v", 0}, {"current_a", -1}}), (Names{"voltage_v", "current_a"}));
  EXPECT_EQ(marked("battery_status", {{"voltage_v", 7.4}, {"current_a", -2}}), Names());
  EXPECT_EQ(marked("distance_sensor", {{"current_distance", 1}, {"signal_quality", 0}}), Names{"current_distance"});
  EXPECT_EQ(marked("distance_sensor", {{"current_distance", 1}, {"signal_quality", -1}}), Names());  // unknown
  EXPECT_EQ(marked("sensor_msgs/msg/Range", {{"min_range", 0.1}, {"max_range", 4}, {"range", 4.5}}), Names{"range"});
  EXPECT_EQ(marked("sensor_msgs/msg/Range", {{"min_range", 0.1}, {"max_range", 4}, {"range", 4}}), Names());
  EXPECT_EQ(marked("sensor_msgs/msg/NavSatFix", {{"status.status", -1}, {"latitude", 0}, {"altitude", 0}}),
            (Names{"latitude", "altitude"}));
  EXPECT_EQ(
      marked("sensor_msgs/msg/NavSatFix", {{"status.status", 0}, {"altitude", 0}, {"position_covariance_type", 0}}),
      Names());
}

TEST(MessageRows, NamesNothingInside) {
  ros::Definitions d;
  d.add("p/msg/M",
        "string[] name\nInner inner\nfloat32[2] own\n" + std::string(80, '=') + "\nMSG: p/Inner\nfloat32[2] x\n");
  MessageRows rows(d.layout("p/M"));
  std::vector<std::string> names;
  for (const Item& item : rows.read(encode(*d.layout("p/M"), {{"name[0]", "a"}, {"name[1]", "b"}})))
    names.push_back(item.name);
  EXPECT_EQ(names, (std::vector<std::string>{"inner.x[0]", "inner.x[1]", "own[a]", "own[b]"}));
}

TEST(MessageRows, StampsOfTheStartOf1970) {
  std::int64_t stamp_ns = kNoTime;
  row_of("sensor_msgs/Imu",
         {{"header.stamp.sec", std::int64_t{-1}}, {"header.stamp.nanosec", std::int64_t{999'000'000}}}, &stamp_ns);
  EXPECT_EQ(stamp_ns, -1'000'000);
}

}  // namespace
}  // namespace flappy::flightlog
