#include "flightlog/import/sources.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <fstream>

#include "flightlog/import/ulogs.hpp"
#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/messages.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::sources_test {
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

TEST(Sources, ReadATableWithGapsThatWasCutOff) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "camera.csv") << "t,  x,  y\n0.5,  1,  nan\n0.6, , 3\n0.7, 4, 5\n0.8, 6";
  Lines warnings;
  const Channels channels = read(folder / "camera.csv", &warnings, {{"*", {"t", "x", "y"}}});
  const std::vector<double>&x = *channels.find("*")->column("x"), &y = *channels.find("camera")->column("y");
  ASSERT_EQ(x.size(), 3u);
  EXPECT_TRUE(x[0] == 1 && std::isnan(x[1]) && x[2] == 4);
  EXPECT_TRUE(std::isnan(y[0]) && y[1] == 3 && y[2] == 5);
  EXPECT_EQ(warnings, (Lines{(folder / "camera.csv").string() + ": its last line was cut off: left out"}));
  // The last line may want its end, but not its cells.
  std::ofstream(folder / "whole.csv") << "t,x\n0.5,1\n0.6,2";
  EXPECT_EQ(read(folder / "whole.csv").find("whole")->column("x")->size(), 2u);
  std::ofstream(folder / "torn.csv") << "t,x\n0.5\n0.6,2\n";
  EXPECT_EQ(test::refusal([&] { read(folder / "torn.csv"); }),
            (folder / "torn.csv").string() + ":2:4: row has 1 cells; accepted: 2, as in the header");
}

std::string gzipped(const std::string& text) {
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

TEST(Sources, ReadATableMadeSmaller) {
  const io::TemporaryFolder folder;
  std::string text = "t,x\n";
  for (int i = 0; i < 100000; ++i) text += std::to_string(i) + "," + std::to_string(i % 977) + "\n";
  const std::string packed = gzipped(text);
  std::ofstream(folder / "camera.csv.gz") << packed;
  const Channels channels = read(folder / "camera.csv.gz");
  ASSERT_NE(channels.find("camera"), nullptr);
  EXPECT_EQ(channels.find("camera")->column("x")->size(), 100000u);
  EXPECT_EQ(channels.find("camera")->column("x")->at(99999), 99999 % 977);
  // Two files one after the other are one; a part of one is read as far as it goes.
  std::ofstream(folder / "two.csv.gz") << gzipped("t,x\n1,2\n") << gzipped("3,4\n");
  EXPECT_EQ(*read(folder / "two.csv.gz").find("two")->column("x"), (std::vector<double>{2, 4}));
  std::ofstream(folder / "part.csv.gz") << packed.substr(0, packed.size() / 2);
  Lines warnings;
  const Channels part = read(folder / "part.csv.gz", &warnings);
  EXPECT_GT(part.find("part")->column("x")->size(), 30000u);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0], (folder / "part.csv.gz").string() + ": is damaged or was cut off: read as far as it goes");
  std::ofstream(folder / "none.csv.gz") << packed.substr(0, 5);
  EXPECT_EQ(test::refusal([&] { read(folder / "none.csv.gz"); }),
            (folder / "none.csv.gz").string() + ": is no whole file of gzip; accepted: what gzip made");
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
}  // namespace flappy::flightlog::sources_test
