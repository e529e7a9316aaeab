#include "flightlog/import/sources.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "flightlog/import/ulogs.hpp"
#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/messages.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

Channels read(const fs::path& file, Lines* warnings = nullptr, Wanted wanted = {}) {
  Channels channels(std::move(wanted));
  Lines ignored;
  read_source(file, channels, warnings ? *warnings : ignored);
  return channels;
}

TEST(Sources, ReadABag) {
  const io::TemporaryFolder folder;
  {
    ros::McapWriter writer(folder / "f.mcap");
    const auto layout = ros::standard_messages().layout("sensor_msgs/Imu");
    const auto imu =
        writer.add_topic("/imu", "sensor_msgs/msg/Imu", ros::standard_messages().concatenated("sensor_msgs/Imu"), "");
    const auto own = writer.add_topic("/own", "q/msg/Own", "Unknown x\n", "");
    const auto other = writer.add_topic("/other", "q/msg/Other", "Unknown x\n", "");
    for (int i = 0; i < 3; ++i)
      writer.write(imu, 100 + i, 0,
                   encode(*layout, {{"header.stamp.nanosec", std::int64_t{i}}, {"angular_velocity.z", 0.5 * i}}));
    writer.write(imu, 200, 0, "no message");
    writer.write(imu, 201, 0, "no message either");
    writer.write(own, 202, 0, "x");
    writer.write(other, 203, 0, "x");
  }
  Lines warnings;
  const Channels channels = read(folder / "f.mcap", &warnings, {{"/imu", {"angular_velocity.z"}}, {"/own", {"x"}}});
  const Channel& imu = *channels.find("/imu");
  EXPECT_EQ(*imu.column("angular_velocity.z"), (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(imu.column("angular_velocity.x"), nullptr);
  EXPECT_EQ(imu.received_ns(), (std::vector<std::int64_t>{100, 101, 102}));
  EXPECT_EQ(imu.stamp_ns(), (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_EQ(channels.names(), (Lines{"/imu", "/other", "/own"}));  // all are known, for whoever misspells one
  const std::string file = (folder / "f.mcap").string();
  EXPECT_EQ(warnings,
            (Lines{file + ": /own: q/msg/Unknown has no definition: left out",
                   file + ": /imu: 2 messages left out, the first because begins with no header of plain CDR"}));
}

TEST(Sources, ReadATable) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "camera.csv") << "t,x\n0.5,1\n0.6,2\n";
  const Channels channels = read(folder / "camera.csv");
  EXPECT_EQ(*channels.find("camera")->column("x"), (std::vector<double>{1, 2}));
  EXPECT_EQ(channels.find("camera")->stamp_ns(), (std::vector<std::int64_t>{kNoTime, kNoTime}));
}

TEST(Sources, ReadAUlogWhateverItIsCalled) {
  const io::TemporaryFolder folder;
  test::UlogText log;
  log.format("t:uint64_t timestamp;float a;")
      .topic(0, 1, "t")
      .data(1, std::string(8, '\0') + test::UlogText::bytes(2.0f));
  std::ofstream(folder / "log.bin") << log.text;
  EXPECT_EQ(*read(folder / "log.bin").find("t")->column("a"), (std::vector<double>{2}));
}

TEST(Sources, RefuseWhatTheyCannotRead) {
  const io::TemporaryFolder folder;
  const std::string at = folder.path().string();
  std::ofstream(folder / "f.mcap") << "t,x\n";
  EXPECT_EQ(test::refusal([&] { read(folder / "f.mcap"); }),
            at + "/f.mcap: does not begin as a .mcap file; accepted: a bag, a ULog or a CSV");
  std::ofstream(folder / "f.csv") << "t,x\n1,a\n";
  EXPECT_EQ(test::refusal([&] { read(folder / "f.csv"); }),
            at + "/f.csv:2:3: x: \"a\" is not a number; accepted: a number");
  EXPECT_EQ(test::refusal([&] { read(folder / "none.csv"); }),
            at + "/none.csv: cannot be read: No such file or directory");
  fs::create_directory(folder / "empty");
  EXPECT_EQ(test::refusal([&] { read(folder / "empty"); }),
            at + "/empty: holds no bag; accepted: rosbag2's .mcap or .db3 files, or a folder of them");
}

}  // namespace
}  // namespace flappy::flightlog
