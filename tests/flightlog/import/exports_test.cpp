// Tables of other programs as they come, from file and mapping to the log.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "flightlog/import/assemble.hpp"
#include "flightlog/import/sources.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::exports_test {
namespace {

using Lines = std::vector<std::string>;

const std::string kHead =
    "schema = 1\nvehicle = \"bird.toml\"\ngravity_m_s2 = 9.81\n"
    "ambient = { air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }\n"
    "[command]\nchannel = \"motors\"\ntime = \"field\"\ntime_field = \"t\"\ninputs = [\"u\"]\ncolumns = { u = \"u\" "
    "}\n";
const std::string kNoise = "latency_s = 0.0\nposition_noise_m = 1e-4\nattitude_noise_rad = 5e-3\n";
const std::string kPose =
    "columns = { x_m = \"x\", y_m = \"y\", z_m = \"z\", qw = \"qw\", qx = \"qx\", qy = \"qy\", qz = \"qz\" }\n";

/// A recording: commands at 0.00 s to 0.19 s, and files of poses.
class Recording {
 public:
  explicit Recording(double start_s = 0) {
    std::string text = "t,u\n";
    char line[64];
    for (int i = 0; i < 20; ++i) std::snprintf(line, sizeof line, "%.3f,0.5\n", start_s + 0.01 * i), text += line;
    add("motors.csv", text);
  }
  void add(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    files_.push_back(folder_ / name);
  }
  Imported import(const std::string& streams) {
    warnings.clear();
    std::ofstream(folder_ / "m.toml") << kHead << streams;
    const Mapping mapping = read_mapping(folder_ / "m.toml");
    Channels channels(mapping.wanted(), mapping.wanted_times());
    for (const auto& file : files_) read_source(file, channels, warnings);
    return assemble(channels, mapping);
  }
  /// What is refused, without the folder.
  std::string refusal(const std::string& streams) {
    std::string line = test::refusal([&] { import(streams); });
    const std::string folder = folder_.path().string() + "/";
    for (std::size_t at = 0; (at = line.find(folder)) != std::string::npos;) line.erase(at, folder.size());
    return line;
  }

  Lines warnings;

 private:
  io::TemporaryFolder folder_;
  std::vector<std::filesystem::path> files_;
};

TEST(Exports, UnitsOfATableNeedNotBeSaid) {
  Recording r;
  r.add("camera.csv",
        "Time,x,y,z,roll,pitch,yaw\nms,mm,cm,m,deg,rad,\n0,1000,2,3,90,0,0\n10,1000,2,3,90,0,0\n20,1000,2,3,90,0,0\n");
  const std::string stream = "[mocap]\nchannel = \"camera\"\ntime = \"field\"\ntime_field = \"Time\"\n" + kNoise +
                             "columns = { x_m = \"x\", y_m = \"y\", z_m = \"z\", roll_rad = \"roll\", pitch_rad = "
                             "\"pitch\", yaw_rad = \"yaw\" }\n";
  const MocapStream m = r.import(stream).log.mocap;
  EXPECT_EQ(m.t_s, (Column{0, 0.01, 0.02}));
  EXPECT_DOUBLE_EQ(m.x_m[0], 1);
  EXPECT_DOUBLE_EQ(m.y_m[0], 0.02);
  EXPECT_EQ(m.z_m[0], 3);
  EXPECT_NEAR(m.qx[0], std::sqrt(0.5), 1e-12);
  // what the mapping says counts alone
  EXPECT_EQ(r.import(stream + "scale = { x_m = 0.5 }\n").log.mocap.x_m[0], 500);
  EXPECT_EQ(r.refusal("[mocap]\nchannel = \"camera\"\ntime = \"field\"\ntime_field = \"Time\"\n" + kNoise +
                      "columns = { x_m = \"roll\", y_m = \"y\", z_m = \"z\", roll_rad = \"roll\", pitch_rad = "
                      "\"pitch\", yaw_rad = \"yaw\" }\n"),
            "m.toml:18:19: mocap.columns.x_m: \"roll\" is in deg; accepted: a field of another unit");
}

TEST(Exports, ADateAndATimeOfDayAreATime) {
  for (const auto& [names, field, between, ends] :
       {std::tuple("date,time", "[\"date\", \"time\"]", ",", ""), std::tuple("when", "\"when\"", "T", "+00:00")}) {
    Recording r(1777852800 + 36900);
    std::string text = std::string(names) + ",x,y,z,qw,qx,qy,qz\n";
    for (int i = 0; i < 3; ++i)
      text += "2026-05-04" + std::string(between) + "10:15:00.0" + std::to_string(i) + ends + ",1,2,3,1,0,0,0\n";
    r.add("camera.csv", text);
    const FlightLog log =
        r.import("[mocap]\nchannel = \"camera\"\ntime = \"field\"\ntime_field = " + std::string(field) + "\n" + kNoise +
                 kPose)
            .log;
    EXPECT_EQ(r.warnings, Lines());
    ASSERT_EQ(log.mocap.t_s.size(), 3u);
    EXPECT_NEAR(log.mocap.t_s[2], 0.02, 3e-7);  // a double holds s from 1970 to 2.4e-7
    EXPECT_NEAR(log.command.t_s[2], 0.02, 3e-7);
  }
  EXPECT_NE(Recording()
                .refusal("[mocap]\nchannel = \"camera\"\ntime = \"field\"\ntime_field = [\"a\", \"b\", \"c\"]\n" +
                         kNoise + kPose)
                .find("mocap.time_field: has more than two fields; accepted: a field, or one of the date and one of "
                      "the time of day"),
            std::string::npos);
}

TEST(Exports, ElementsOfListsAreFields) {
  Recording r;
  std::string text = "t,p,q\n";
  for (int i = 0; i < 3; ++i) text += "0.0" + std::to_string(i) + ",\"[1.5, 2.5, 3.5]\",\"[0.0, 0.0, 0.0, 1.0]\"\n";
  r.add("camera.csv", text);
  const MocapStream m = r.import("[mocap]\nchannel = \"camera\"\ntime = \"field\"\ntime_field = \"t\"\n" + kNoise +
                                 "columns = { x_m = \"p[0]\", y_m = \"p[1]\", z_m = \"p[2]\", qw = \"q[3]\", qx = "
                                 "\"q[0]\", qy = \"q[1]\", qz = \"q[2]\" }\n")
                            .log.mocap;
  EXPECT_EQ(m.z_m, (Column{3.5, 3.5, 3.5}));
  EXPECT_EQ(m.qw, (Column{1, 1, 1}));
}

}  // namespace
}  // namespace flappy::flightlog::exports_test
