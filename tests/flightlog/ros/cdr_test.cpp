#include "flightlog/ros/cdr.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "flightlog/ros/bag.hpp"
#include "flightlog/ros/ros_messages.hpp"
#include "flightlog/ros/type_hash.hpp"

namespace flappy::flightlog::ros::cdr_test {
namespace {

std::string bytes_of(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

std::string hex_of(std::string_view bytes) {
  std::string hex;
  for (const char c : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned char>(c));
    hex += digits;
  }
  return hex;
}

std::string written(const char* type, const Members& members) {
  return hex_of(encode(*standard_messages().layout(type), members));
}

std::string fault(const char* type, std::string_view bytes) {
  try {
    decode(*standard_messages().layout(type), bytes);
    return "accepted";
  } catch (const MessageError& error) {
    return error.what();
  }
}

const std::int64_t kSec = 7, kNanosec = 250'000'000;
const Members kHeader = {{"header.stamp.sec", kSec}, {"header.stamp.nanosec", kNanosec}, {"header.frame_id", "torso"}};

Members with_header(Members members) {
  members.insert(kHeader.begin(), kHeader.end());
  return members;
}

// what the Python package rosbags 0.11.9 writes of the same members

const std::string kJointState =
    "000100000700000080b2e60e06000000746f72736f00000002000000050000006c656674000000000d00000072696768745f"
    "7374726f6b65000000000200000000000000000000000000f83f000000000000d0bf00000000010000000000000000000840";

TEST(Cdr, WritesSequences) {
  EXPECT_EQ(written("sensor_msgs/JointState", with_header({{"name[0]", "left"},
                                                           {"name[1]", "right_stroke"},
                                                           {"position[0]", 1.5},
                                                           {"position[1]", -0.25},
                                                           {"effort[0]", 3.0}})),
            kJointState);
}

TEST(Cdr, WritesNumbersOfAllSizes) {
  EXPECT_EQ(written("sensor_msgs/BatteryState", with_header({{"voltage", 7.5},
                                                             {"temperature", std::nan("")},
                                                             {"current", -1.25},
                                                             {"percentage", 0.5},
                                                             {"power_supply_status", std::int64_t{2}},
                                                             {"power_supply_health", std::int64_t{1}},
                                                             {"power_supply_technology", std::int64_t{3}},
                                                             {"present", std::uint64_t{1}},
                                                             {"cell_voltage[0]", 3.75},
                                                             {"cell_voltage[1]", 3.5},
                                                             {"serial_number", "b7"}})),
            "000100000700000080b2e60e06000000746f72736f0000000000f0400000c07f0000a0bf0000000000000000000000000000"
            "003f0201030102000000000070400000604000000000010000000000000003000000623700");
  EXPECT_EQ(written("flappy_msgs/Command", {{"stamp.sec", std::int64_t{1}},
                                            {"stamp.nanosec", std::int64_t{2}},
                                            {"id", "a1"},
                                            {"verb", "add"},
                                            {"kind", "train"},
                                            {"config", "c.toml"},
                                            {"job", (std::uint64_t{1} << 40) + 1},
                                            {"overrides[0]", "x=1"},
                                            {"overrides[1]", "yy=22"}}),
            "0001000001000000020000000300000061310000040000006164640006000000747261696e00000007000000632e746f6d6c"
            "000001000000000100000200000004000000783d31000600000079793d323200");
}

TEST(Cdr, WritesMessagesInMessages) {
  EXPECT_EQ(written("tf2_msgs/TFMessage", {{"transforms[0].header.stamp.sec", std::int64_t{-1}},
                                           {"transforms[0].header.stamp.nanosec", std::int64_t{5}},
                                           {"transforms[0].header.frame_id", "w"},
                                           {"transforms[0].child_frame_id", "torso"},
                                           {"transforms[0].transform.translation.x", 1.0},
                                           {"transforms[0].transform.translation.y", 2.0},
                                           {"transforms[0].transform.translation.z", 3.0},
                                           {"transforms[0].transform.rotation.w", 1.0}}),
            "0001000001000000ffffffff05000000020000007700000006000000746f72736f000000000000000000f03f000000000000"
            "00400000000000000840000000000000000000000000000000000000000000000000000000000000f03f");
  EXPECT_EQ(written("diagnostic_msgs/DiagnosticArray", {{"status[0].level", std::int64_t{1}},
                                                        {"status[0].name", "a"},
                                                        {"status[0].message", "bc"},
                                                        {"status[0].values[0].key", "k"},
                                                        {"status[0].values[0].value", "v"},
                                                        {"status[0].values[1].value", "long one"},
                                                        {"status[1].level", std::int64_t{2}},
                                                        {"status[1].hardware_id", "h"}}),
            "0001000000000000000000000100000000000000020000000100000002000000610000000300000062630000010000000000"
            "000002000000020000006b00000002000000760000000100000000000000090000006c6f6e67206f6e650002000001000000"
            "000000000100000000000000020000006800000000000000");
}

TEST(Cdr, ReadsWhatItWrote) {
  const auto layout = standard_messages().layout("sensor_msgs/JointState");
  const Members read = decode(*layout, bytes_of(kJointState));
  EXPECT_EQ(read, with_header({{"name[0]", "left"},
                               {"name[1]", "right_stroke"},
                               {"position[0]", 1.5},
                               {"position[1]", -0.25},
                               {"effort[0]", 3.0},
                               {"header.stamp.nanosec", std::uint64_t{250'000'000}}}));
}

TEST(Cdr, ReadsBigEndian) {
  Definitions d;
  d.add("p/msg/M", "int16 a\nfloat64 b\nstring s\n");
  const std::string bytes = bytes_of(
      "00000000fffe0000000000004004000000000000000000036869"
      "00");
  EXPECT_EQ(decode(*d.layout("p/M"), bytes), (Members{{"a", std::int64_t{-2}}, {"b", 2.5}, {"s", "hi"}}));
}

TEST(Cdr, TellsOfTheFirstElementsAlone) {
  Definitions d;
  d.add("p/msg/M", "uint16[] pixels\nstring[] words\nuint8 after\n");
  Members members = {{"after", std::int64_t{9}}};
  const std::size_t count = kMaxElements + 500;
  for (std::size_t i = 0; i < count; ++i) {
    members["pixels[" + std::to_string(i) + "]"] = std::uint64_t{i};
    members["words[" + std::to_string(i) + "]"] = "w";
  }
  const Members read = decode(*d.layout("p/M"), encode(*d.layout("p/M"), members));
  EXPECT_EQ(read.size(), 2 * kMaxElements + 1);
  EXPECT_EQ(read.at("after"), (Members::mapped_type(std::uint64_t{9})));
}

TEST(Cdr, RefusesEveryTruncation) {
  const std::string whole = bytes_of(kJointState);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(fault("sensor_msgs/JointState", whole.substr(0, size)), "accepted") << size;
  EXPECT_EQ(fault("sensor_msgs/JointState", whole + "padding"), "accepted");
  EXPECT_EQ(fault("sensor_msgs/JointState", whole.substr(0, 90)), "effort: the message ends before it");
}

TEST(Cdr, RefusesBytesThatContradictTheLayout) {
  std::string bytes = bytes_of(kJointState);
  bytes[1] = 3;  // a parameter list
  EXPECT_EQ(fault("sensor_msgs/JointState", bytes),
            "begins with no header of plain CDR, as where messages are compressed one by one");
  bytes = bytes_of(kJointState);
  bytes[21] = 'x';  // the zero of "torso"
  EXPECT_EQ(fault("sensor_msgs/JointState", bytes), "header.frame_id: is a string without an end");
  bytes = bytes_of(kJointState);
  std::fill_n(bytes.begin() + 24, 4, '\xff');  // how many names
  EXPECT_EQ(fault("sensor_msgs/JointState", bytes), "name: the message ends before it");
  EXPECT_EQ(fault("flappy_msgs/CommandResult", "abc"),
            "begins with no header of plain CDR, as where messages are compressed one by one");
}

TEST(Cdr, RefusesMembersThatDoNotFit) {
  const auto refused = [](const char* type, const Members& members) {
    try {
      encode(*standard_messages().layout(type), members);
      return std::string("accepted");
    } catch (const MessageError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refused("flappy_msgs/Command", {{"verb", std::string(17, 'x')}}), "verb: is longer than 16");
  EXPECT_EQ(refused("flappy_msgs/Command", {{"job", "one"}}), "job: is text where a number belongs");
  EXPECT_EQ(refused("flappy_msgs/Command", {{"id", 1.0}}), "id: is a number where text belongs");
  Members many;
  for (int i = 0; i < 33; ++i) many["overrides[" + std::to_string(i) + "]"] = "a=b";
  EXPECT_EQ(refused("flappy_msgs/Command", many), "overrides: has 33 elements, at most 32 are declared");
}

/// For tests/tools/bags_test.py: a bag of others, whose topics end in the hashes of their types.
TEST(Cdr, GivesBackTheMessagesOfABagFromOutside) {
  const char* const path = std::getenv("FLAPPY_BAG");
  if (!path) GTEST_SKIP();
  const auto bag = Bag::open(path);
  std::size_t count = 0;
  std::set<std::string> types;
  while (const auto message = bag->next()) {
    const auto layout = standard_messages().layout(message->topic->type);
    ASSERT_TRUE(message->topic->name.ends_with("/" + type_hash(*layout))) << message->topic->name;
    ASSERT_EQ(type_hash(*layout_of(*message->topic)), type_hash(*layout)) << message->topic->definition;
    ASSERT_EQ(hex_of(encode(*layout, decode(*layout, message->bytes))), hex_of(message->bytes)) << message->topic->name;
    types.insert(layout->name);
    ++count;
  }
  std::printf("%zu messages of %zu types\n", count, types.size());
}

}  // namespace
}  // namespace flappy::flightlog::ros::cdr_test
