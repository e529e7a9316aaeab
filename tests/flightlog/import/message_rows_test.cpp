#include "flightlog/import/message_rows.hpp"

#include <gtest/gtest.h>

#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/messages.hpp"

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
