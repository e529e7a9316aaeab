#include "flightlog/import/sources.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <fstream>

#include "flightlog/import/ulogs.hpp"
#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/ros_messages.hpp"
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
  EXPECT_EQ(warnings, (Lines{file + ": /own: q/msg/Unknown has no definition: left out",
                             file + ": /imu: 2 messages left out, the first because begins with no header of plain "
                                    "CDR, as where messages are compressed one by "
                                    "one"}));
}

TEST(Sources, ReadATable) {
  const io::TemporaryFolder folder;
  std::ofstream(folder / "camera.csv") << "t,x\n0.5,1\n0.6,2\n";
  const Channels channels = read(folder / "camera.csv");
  EXPECT_EQ(*channels.find("camera")->column("x"), (std::vector<double>{1, 2}));
  EXPECT_EQ(channels.find("camera")->stamp_ns(), (std::vector<std::int64_t>{kNoTime, kNoTime}));
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
            at + "/f.mcap: does not begin as a .mcap file; accepted: a bag, a ULog, a usdlog, a log of ArduPilot, a "
                 "MATLAB file, a C3D or a CSV");
  std::ofstream(folder / "f.csv") << "t,x\n1,2,3\n";
  EXPECT_EQ(test::refusal([&] { read(folder / "f.csv"); }),
            at + "/f.csv:2:1: 3 cells for 2 names, and no row is otherwise; accepted: rows of as many cells");
  EXPECT_EQ(test::refusal([&] { read(folder / "none.csv"); }),
            at + "/none.csv: cannot be read: No such file or directory");
  fs::create_directory(folder / "empty");
  EXPECT_EQ(test::refusal([&] { read(folder / "empty"); }),
            at + "/empty: holds no bag; accepted: rosbag2's .mcap or .db3 files, or a folder of them");
}

TEST(Sources, SayWhatOtherFilesAre) {
  const io::TemporaryFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(folder / name) << bytes;
    const std::string line = test::refusal([&] { read(folder / name); });
    return line.substr(std::min(line.size(), (folder / name).string().size()));
  };
  const std::string accepted = "; accepted: a bag, a ULog, a usdlog, a log of ArduPilot, a MATLAB file, a C3D or a CSV";
  EXPECT_EQ(refusal("log.bag", "#ROSBAG V2.0\n..."),
            ": is a bag of ROS 1" + accepted + ", as made by: rosbags-convert --src FILE --dst FOLDER");
  EXPECT_EQ(refusal("named.csv", "#ROSBAG V2.0\n..."),
            ": is a bag of ROS 1" + accepted + ", as made by: rosbags-convert --src FILE --dst FOLDER");
  EXPECT_EQ(refusal("bag_0.mcap.zstd", "\x28\xB5\x2F\xFD..."),
            ": is compressed by zstd" + accepted + ", as made by: zstd -d FILE");
  EXPECT_EQ(refusal("log.zip", "PK\x03\x04..."), ": is a zip archive, as .npz and .xlsx files are" + accepted +
                                                     ", as made by: unzip FILE, or export it as CSV");
  EXPECT_EQ(refusal("flight.bbl", "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\n"),
            ": is a blackbox log of Betaflight or INAV" + accepted +
                ", as made by: blackbox_decode FILE, of that firmware's blackbox-tools");
  EXPECT_EQ(refusal("bench.tdms", "TDSm\x0e"),
            ": is a TDMS file of LabVIEW" + accepted +
                ", as made by: nptdms.TdmsFile.read(FILE)[GROUP].as_dataframe(time_index=True).to_csv(\"forces.csv\", "
                "index_label=\"time\")");
  EXPECT_EQ(refusal("bench.tdms_index", "TDSh\x0e"),
            ": is the index of a TDMS file" + accepted + ", as made by: the same of the .tdms file");
  EXPECT_EQ(refusal("take.mat.gz", gzipped("MATLAB 5.0 MAT-file, Platform: GLNXA64")),
            ": is a MATLAB file compressed by gzip" + accepted + ", as made by: gunzip FILE");
  // one variable "t" of 1 x 1: kind, rows, columns, whether complex, letters of the name
  for (const std::string& first : {std::string("\0\0\0\0\1\0\0\0\1\0\0\0\0\0\0\0\2\0\0\0", 20),
                                   std::string("\0\0\3\xE8\0\0\0\1\0\0\0\1\0\0\0\0\0\0\0\2", 20)})
    EXPECT_EQ(refusal("old.mat", first + std::string("t\0", 2) + std::string(8, '\0')),
              ": is a MATLAB file of version 4" + accepted + ", as made by: save with -v7");
  EXPECT_EQ(refusal("old.mat", "# Created by Octave 8.4.0, Mon May 04 10:15:00 2026 UTC\n# name: t\n"),
            ": is a text file of Octave" + accepted + ", as made by: save -v7 FILE");
  EXPECT_EQ(refusal("LOG00001.BFL", "H Data version:2\n"), ": does not begin as a .bfl file" + accepted);
  EXPECT_EQ(refusal("any.zip", "any bytes"), ": does not begin as a .zip file" + accepted);
  EXPECT_EQ(refusal("bytes.csv", std::string("t,x\n\0\1", 6)), ": holds bytes that are no text" + accepted);
  EXPECT_EQ(refusal("bag.mcap.gz", gzipped("\x89MCAP0\r\n...")),
            ": is a bag compressed by gzip" + accepted + ", as made by: gunzip FILE");
  EXPECT_EQ(refusal("wide.csv", "\xFF\xFEt"),
            ": is text in UTF-16" + accepted + ", as made by: iconv -f UTF-16 -t UTF-8 FILE");
}

TEST(Sources, ReadAUlogCompressedByGzip) {
  const io::TemporaryFolder folder;
  test::UlogText log;
  log.format("t:uint64_t timestamp;float a;")
      .topic(0, 1, "t")
      .data(1, std::string(8, '\0') + test::UlogText::bytes(2.0f));
  std::ofstream(folder / "log.ulg.gz") << gzipped(log.text);
  EXPECT_EQ(*read(folder / "log.ulg.gz").find("t")->column("a"), (std::vector<double>{2}));
}

TEST(Sources, ReadATopicWhoseTypeChanged) {
  const io::TemporaryFolder folder;
  {
    ros::McapWriter writer(folder / "f.mcap");
    ros::Definitions own;
    own.add("q/msg/Number", "float64 data\n");
    own.add("q/msg/Text", "string data\n");
    const auto number = writer.add_topic("/x", "q/msg/Number", own.concatenated("q/msg/Number"), "");
    const auto text = writer.add_topic("/x", "q/msg/Text", own.concatenated("q/msg/Text"), "");
    writer.write(text, 1, 0, encode(*own.layout("q/msg/Text"), {{"data", std::string("hello")}}));
    for (int i = 0; i < 2; ++i)
      writer.write(number, 2 + i, 0, encode(*own.layout("q/msg/Number"), {{"data", 1.5 + i}}));
  }
  Lines warnings;
  const Channels channels = read(folder / "f.mcap", &warnings);
  EXPECT_EQ(*channels.find("/x")->column("data"), (std::vector<double>{1.5, 2.5}));
  EXPECT_EQ(warnings, Lines());
}

}  // namespace
}  // namespace flappy::flightlog::sources_test
