#include "flightlog/import/mapping.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::mapping_test {
namespace {

namespace fs = std::filesystem;
const fs::path kMappings = fs::path(FLAPPY_SOURCE_DIR) / "configs" / "mapping";

/// What a person sees of a shipped mapping with `old` in it replaced.
std::string edited_of(const char* shipped, const std::string& old, const std::string& fresh) {
  const io::TemporaryFolder folder;
  std::string text = io::read_text(kMappings / shipped);
  const std::size_t at = text.find(old);
  if (at == std::string::npos) return "\"" + old + "\" is not there";
  text.replace(at, old.size(), fresh);
  std::ofstream(folder / "m.toml") << text;
  const std::string line = test::refusal([&] { read_mapping(folder / "m.toml"); });
  const std::string place = folder.path().string() + "/";
  return line.starts_with(place) ? line.substr(place.size()) : line;
}

/// Of that of ROS 2.
std::string edited(const std::string& old, const std::string& fresh) { return edited_of("ros2.toml", old, fresh); }

TEST(Mapping, ShippedOnesAreRead) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kMappings)) {
    const Mapping m = read_mapping(entry.path());
    EXPECT_GE(m.streams.size(), 2u) << entry.path();  // commands and poses
    EXPECT_TRUE(fs::exists(kMappings.parent_path() / "vehicles" / m.header.vehicle)) << entry.path();
    ++count;
  }
  EXPECT_EQ(count, 13);
}

// Firmwares spell a field in two ways: a list of names, of which a recording has one.
TEST(Mapping, TakesSeveralNamesOfAField) {
  const Mapping m = read_mapping(kMappings / "crazyflie_lee.toml");
  EXPECT_EQ(m.streams.front().columns.front().fields, (FieldNames{"ctrlLee.thrustSI", "ctrlLee.thrustSi"}));
  EXPECT_TRUE(m.wanted().at("fixedFrequency").contains("ctrlLee.thrustSi"));
  EXPECT_EQ(edited_of("crazyflie_lee.toml", "[\"ctrlLee.thrustSI\", \"ctrlLee.thrustSi\"]  #", "[]  #"),
            "m.toml:17:10: command.columns.thrust: is empty; accepted: names of fields");
}

TEST(Mapping, NamesASessionAndNoPathOfAVehicle) {
  EXPECT_EQ(read_mapping(kMappings / "csv.toml", {"session=monday"}).header.session, "monday");
  EXPECT_EQ(
      edited_of("crazyflie_lee.toml", "\"crazyflie_lee.toml\"", "\"../crazyflie_lee.toml\""),
      "m.toml:4:11: vehicle: \"../crazyflie_lee.toml\" is no file name; accepted: the name of the vehicle's file, "
      "without folder");
}

TEST(Mapping, WantsTheFieldsOfItsColumns) {
  const Wanted wanted = read_mapping(kMappings / "ros2.toml").wanted();
  EXPECT_EQ(wanted.at("/motors"), (std::set<std::string>{"effort[left_motor]", "effort[right_motor]"}));
  EXPECT_EQ(wanted.at("/battery"), (std::set<std::string>{"voltage"}));
  EXPECT_TRUE(wanted.at("/wing_input").contains("tick"));
  EXPECT_TRUE(read_mapping(kMappings / "csv.toml").wanted().at("mocap").contains("time_s"));
}

TEST(Mapping, TakesOverrides) {
  const Mapping m = read_mapping(kMappings / "ros2.toml",
                                 {"mocap.time=field", "mocap.time_field=t", "mocap.time_unit=ms", "imu.rate_hz=400"});
  EXPECT_EQ(m.streams[1].time, TimeOf::field);
  EXPECT_EQ(m.streams[1].time_unit_ns, 1e6);
  EXPECT_TRUE(m.streams[1].measures_rate);
  EXPECT_FALSE(m.streams[2].measures_rate);
  EXPECT_EQ(m.header.imu.rate_hz, 400);
}

TEST(Mapping, RefusesFaults) {
  EXPECT_EQ(edited("schema = 1", "schema = 2"),
            "m.toml:3:10: schema: 2 is read by a newer flappy than this one; accepted: 1");
  EXPECT_EQ(edited("channel = \"/pose\"\n", ""), "m.toml:27:1: mocap.channel: is missing; accepted: a string");
  EXPECT_EQ(
      edited("channel = \"/pose\"", "topic = \"/pose\""),
      "m.toml:28:1: mocap.topic: unknown key; accepted: at_rest, attitude_noise_rad, body, channel, clock, columns, "
      "frame, "
      "frame_rate_hz, from, late_s, latency_s, markers, offset, position_noise_m, rate_hz, rotation, scale, sequence, "
      "source, time, "
      "time_field, time_unit, tolerance_m, unit_m, world");
  EXPECT_EQ(edited("x_m = \"pose", "x_mm = \"pose"),
            "m.toml:34:1: mocap.columns.x_mm: unknown key; accepted here with another unit: \"x_m\"");
  EXPECT_EQ(edited("qz = \"pose.orientation.z\"\n", ""),
            "m.toml:33:1: mocap.columns.qz: is missing; accepted: a string");
  EXPECT_EQ(edited("bias_V = \"bias_v\"\n", ""),
            "m.toml:21:15: command.columns.amplitude_V: is given without bias_V; accepted: all four inputs of the wing "
            "beat, or none");
  EXPECT_EQ(edited("clock = \"robot\"\nsequence", "time = \"received\"\nclock = \"robot\"\nsequence"),
            "m.toml:17:9: command.clock: \"robot\" is not the clock of times of receipt; accepted: \"receiver\", or "
            "time = \"stamp\"");
  EXPECT_EQ(edited("clock = \"robot\"\nsequence", "time_unit = \"s\"\nsequence"),
            "m.toml:16:13: command.time_unit: is given with time = \"stamp\"; accepted: time = \"field\"");
  EXPECT_EQ(edited("[command]", "[clocks.robbot]\noffset_s = 1.0\n\n[command]"),
            "m.toml:14:1: clocks.robbot: is no clock of a stream; accepted: names that clock = \"...\" has");
  EXPECT_EQ(edited("[mocap]", "[command.scale]\nphase_radd = 2.0\n\n[mocap]"),
            "m.toml:28:1: command.scale.phase_radd: unknown key; accepted: amplitude_V, bias_V, difference_V, "
            "left_voltage_V, "
            "phase_rad, right_voltage_V, split_cycle; did you mean \"phase_rad\"?");
  EXPECT_EQ(edited("phase_rad = \"phase_rad\"\n", "[command.scale]\nphase_rad = 2.0\n"),
            "m.toml:26:13: command.scale.phase_rad: has no such column; accepted: columns of command.columns");
  EXPECT_EQ(edited("latency_s = 0.0", "latency_s = -1.0"),
            "m.toml:30:13: mocap.latency_s: -1 is out of range; accepted: a number from 0 to 10");
}

/// Of that of declared inputs.
std::string edited_inputs(const std::string& old, const std::string& fresh) {
  return edited_of("flapper_nimble.toml", old, fresh);
}

TEST(Mapping, OfInputsRefusesFaults) {
  EXPECT_EQ(edited_inputs("left_flap = \"m1\"\n", ""),
            "m.toml:21:1: command.columns.left_flap: is missing; accepted: a string");
  EXPECT_EQ(edited_inputs("left_flap = \"m1\"", "left_flop = \"m1\""),
            "m.toml:22:1: command.columns.left_flop: unknown key; accepted: left_flap, pitch_servo, right_flap, "
            "yaw_servo; did you mean \"left_flap\"?");
  EXPECT_EQ(edited_inputs("above = 0.0\n", ""), "m.toml:31:1: command.flown.above: is missing; accepted: a number");
  EXPECT_EQ(edited_inputs("yaw_rad = \"otYaw0\"\n", ""),
            "m.toml:43:1: mocap.columns.yaw_rad: is missing; accepted: a string");
  EXPECT_EQ(edited_inputs("yaw_rad = \"otYaw0\"", "yaw_rad = \"otYaw0\"\nqw = \"w\""),
            "m.toml:50:1: mocap.columns.qw: unknown key; accepted: pitch_rad, roll_rad, x_m, y_m, yaw_rad, z_m");
  EXPECT_EQ(edited_inputs("gyro = false", "gyro_noise_rad_s = 0.1\ngyro = false").substr(0, 48),
            "m.toml:60:1: imu.gyro_noise_rad_s: unknown key; ");
  EXPECT_EQ(
      edited_inputs("inputs = [\"left_flap\", \"right_flap\", \"pitch_servo\", \"yaw_servo\"]\n", "").substr(0, 39),
      "m.toml:21:1: command.columns.left_flap:");
}

}  // namespace
}  // namespace flappy::flightlog::mapping_test
