// Tables of other programs as they come, from file and mapping to the log.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

#include "flightlog/import/c3ds.hpp"
#include "flightlog/import/import_files.hpp"
#include "flightlog/import/mats.hpp"
#include "flightlog/import/ulogs.hpp"
#include "flightlog/rotation.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"
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
  /// Writes a file that is none of the recording.
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  void add(const std::string& name, const std::string& text) {
    write(name, text);
    files_.push_back(folder_ / name);
  }
  /// A place for a file of the recording that the caller writes.
  std::filesystem::path place(const std::string& name) {
    files_.push_back(folder_ / name);
    return files_.back();
  }
  Imported import(const std::string& streams) {
    std::ofstream(folder_ / "m.toml") << kHead << streams;
    return import_files(folder_ / "m.toml", files_, warnings);
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

// ---- one motion in the shapes of all vendors

/// Where the robot is at frame `i`: p in W, and its attitude, turned about all three axes.
struct Pose {
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
};
Pose pose(int i) {
  const double t = 0.01 * i;
  return {{0.5 + t, -0.25 + 2 * t, 1 - t}, exponential({0.4, -0.3 + t, 0.9 + 3 * t})};
}
constexpr int kFrames = 20, kLost = 7;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string numbers(const char* separator, std::initializer_list<double> values, int digits = 9) {
  std::string text;
  for (const double v : values) text += separator + io::format("%.*f", digits, v);
  return text;
}

/// Motive: a row of metadata, rows of type, name, id, (parent,) use and axis; y up; two bodies and markers.
std::string motive(const std::string& version, const std::string& rotation, const std::string& unit,
                   bool z_up = false) {
  const bool quaternion = rotation == "Quaternion";
  std::string text =
      "Format Version," + version +
      ",Take Name,hover,Take Notes,windy, still,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,Total "
      "Exported Frames,20,Rotation Type," +
      rotation + ",Length Units," + unit + ",Coordinate Space,Global\r\n\r\n";
  const int turns = quaternion ? 4 : 3;
  Lines rows = {",Type", ",Name", ",ID", ",", "Frame,Time (Seconds)"};
  if (version == "1.25") rows.insert(rows.begin() + 3, ",Parent");
  if (version == "1.24")
    for (std::string& row : rows) row += &row == &rows.back() ? ",TimeCode" : ",";
  const auto column = [&](const char* type, const char* name, const char* use, const char* axis) {
    const Lines cells =
        version == "1.25" ? Lines{type, name, "9F:1", "", use, axis} : Lines{type, name, "\"1\"", use, axis};
    for (std::size_t k = 0; k < rows.size(); ++k) rows[k] += "," + cells[k];
  };
  for (const char* name : {"box", "robot"}) {
    for (int k = 0; k < turns; ++k) column("Rigid Body", name, "Rotation", std::array{"X", "Y", "Z", "W"}[k]);
    for (const char* axis : {"X", "Y", "Z"}) column("Rigid Body", name, "Position", axis);
    column("Rigid Body", name, "Mean Marker Error", "");
  }
  for (const char* type : {"Rigid Body Marker", "Marker"})
    for (const char* axis : {"X", "Y", "Z"}) column(type, "robot:Marker 001", "Position", axis);
  for (const std::string& row : rows) text += row + "\r\n";
  const double metre = unit == "Meters" ? 1 : 1000;
  for (int i = 0; i < kFrames; ++i) {
    const Pose at = pose(i);
    // of W with z up: x, z, -y with y up
    const Eigen::Quaterniond up(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);
    const Eigen::Vector3d p = metre * (z_up ? at.p : up * at.p);
    const Eigen::Quaterniond q = z_up ? at.q : up * at.q * up.conjugate();  // its body has y up, too
    const Eigen::Vector3d angles = q.toRotationMatrix().eulerAngles(0, 1, 2) * 180 / std::numbers::pi;
    text += std::to_string(i) + numbers(",", {0.01 * i}, 6) + (version == "1.24" ? ",10:15:00:00.00" : "");
    text += quaternion ? ",0,0,0,1,0,0,0,0.1" : ",0,0,0,0,0,0,0.1";
    if (i == kLost) text += quaternion ? ",,,,,,,," : ",,,,,,,";
    else if (quaternion) text += numbers(",", {q.x(), q.y(), q.z(), q.w(), p.x(), p.y(), p.z(), 0.1});
    else text += numbers(",", {angles[0], angles[1], angles[2], p.x(), p.y(), p.z(), 0.1});
    text += ",9,9,9" + numbers(",", {p.x(), p.y(), p.z()}) + "\r\n";
  }
  return text;
}

/// QTM, 6D: keys, names, rows that end with a tab; mm, degrees, the matrix by columns.
std::string qtm(bool names, bool zeros) {
  std::string text =
      "FILE_VERSION\t2.0.0\nNO_OF_FRAMES\t20\nNO_OF_CAMERAS\t8\nNO_OF_BODIES\t2\nFREQUENCY\t100\nNO_OF_"
      "ANALOG\t0\nDESCRIPTION\t--\nTIME_STAMP\t2026-05-04, "
      "10:15:00.000\t1234.5\nDATA_INCLUDED\t6D\nBODY_NAMES\tbox\trobot\n";
  const std::string rest =
      "\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]";
  if (names) text += "Frame\tTime\tbox X" + rest + "\trobot X" + rest + "\n";
  for (int i = 0; i < kFrames; ++i) {
    const Pose at = pose(i);
    const Eigen::Matrix3d r = at.q.toRotationMatrix();
    if (names) text += std::to_string(i + 1) + numbers("\t", {0.01 * i}, 5) + "\t";
    text += "0.000\t0.000\t0.000\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0";
    if (i == kLost)
      for (int k = 0; k < 16; ++k) text += zeros ? "\t0.000" : "\t";
    else
      text += numbers("\t", {1e3 * at.p.x(), 1e3 * at.p.y(), 1e3 * at.p.z(), 1, 2, 3, 0.4, r(0, 0), r(1, 0), r(2, 0),
                             r(0, 1), r(1, 1), r(2, 1), r(0, 2), r(1, 2), r(2, 2)});
    text += "\t\n";
  }
  return text;
}

/// Vicon: title, rate, names, axes, units; `kind` is "Quaternion", or "" for three numbers, in `unit`, by vector or by angles.
std::string vicon(const std::string& title, const std::string& kind, const std::string& unit, bool vector = true) {
  const bool quaternion = kind == "Quaternion";
  const std::string axes = quaternion ? "RX,RY,RZ,RW,TX,TY,TZ" : "RX,RY,RZ,TX,TY,TZ";
  const std::string units = (quaternion ? ",,," : unit + "," + unit + "," + unit) + ",mm,mm,mm";
  const std::string more = quaternion ? ",,,,,,," : ",,,,,,";
  std::string text = title + "\n100\n,,";
  for (const char* name : {"box", "robot"})
    text += "Global Angle " + (kind.empty() ? "" : "(" + kind + ") ") + name + ":" + name +
            (name[0] == 'b' ? more : more.substr(1));
  text += "\nFrame,Sub Frame," + axes + "," + axes + "\n,," + units + "," + units + "\n";
  for (int i = 0; i < kFrames; ++i) {
    const Pose at = pose(i);
    const double one = unit == "deg" ? 180 / std::numbers::pi : 1;
    const Eigen::Vector3d r =
        one * (vector ? logarithm(at.q) : Eigen::Vector3d(at.q.toRotationMatrix().eulerAngles(0, 1, 2)));
    text += std::to_string(i + 1) + ",0" + (quaternion ? ",0,0,0,1,1,2,3" : ",0,0,0,1,2,3");
    if (i == kLost) text += more;
    else if (quaternion) text += numbers(",", {at.q.x(), at.q.y(), at.q.z(), at.q.w()});
    else text += numbers(",", {r.x(), r.y(), r.z()});
    if (i != kLost) text += numbers(",", {1e3 * at.p.x(), 1e3 * at.p.y(), 1e3 * at.p.z()});
    text += "\n";
  }
  return text;
}

std::string stream(const std::string& more, const std::string& channel = "take") {
  return "[mocap]\nchannel = \"" + channel + "\"\n" + kNoise + more;
}

/// The motion, without the frame that was lost, as files round it.
void expect_motion(const Imported& imported, double tolerance = 1e-8) {
  const MocapStream& m = imported.log.mocap;
  ASSERT_EQ(m.t_s.size(), kFrames - 1u);
  EXPECT_NEAR(imported.log.header.mocap.rate_hz, 100, 1e-9);
  for (int i = 0, k = 0; i < kFrames; ++i) {
    if (i == kLost) continue;
    const Pose at = pose(i);
    EXPECT_NEAR(m.t_s[k], 0.01 * i, 1e-12);
    EXPECT_LT((Eigen::Vector3d(m.x_m[k], m.y_m[k], m.z_m[k]) - at.p).norm(), tolerance) << i;
    EXPECT_LT(at.q.angularDistance(Eigen::Quaterniond(m.qw[k], m.qx[k], m.qy[k], m.qz[k])), tolerance) << i;
    ++k;
  }
}

void expect_motion_of(const std::string& name, const std::string& text, const std::string& mapping,
                      const std::string& channel = "take") {
  SCOPED_TRACE(text.substr(0, 200) + mapping);
  Recording r;
  r.add(name, text);
  expect_motion(r.import(stream(mapping, channel)));
  EXPECT_EQ(r.warnings, Lines());
}

const std::string kYUp = "body = \"robot\"\nworld = \"y_up\"\nframe = \"fur\"\n";

TEST(Exports, OfMotiveGiveTheMotion) {
  for (const char* version : {"1.10", "1.23", "1.24", "1.25"})
    for (const char* rotation : {"Quaternion", "XYZ"})
      for (const char* unit : {"Meters", "Millimeters"})
        expect_motion_of("take.csv", motive(version, rotation, unit), kYUp);
  expect_motion_of("take.csv", motive("1.23", "Quaternion", "Meters", true),
                   "body = \"robot\"\nworld = \"enu\"\nframe = \"flu\"\n");
}

/// A first line that a spreadsheet fills up with separators, other separators, and no empty line below the first.
TEST(Exports, OfMotiveMayBeSavedByASpreadsheet) {
  const std::string plain = motive("1.23", "Quaternion", "Millimeters");
  std::string filled = replaced(plain, "Global\r\n\r\n", "Global,,,,,,,,\r\n" + std::string(30, ',') + "\r\n");
  expect_motion_of("take.csv", filled, kYUp);
  std::string more = "Global";  // wider than the table
  for (int k = 0; k < 20; ++k) more += io::format(",Key %d,value %d", k, k);
  expect_motion_of("take.csv", replaced(plain, "Global\r\n\r\n", more + "\r\n"), kYUp);
  for (const char* separator : {";", "\t"}) {
    expect_motion_of("take.csv", replaced(plain, ",", separator), kYUp);
    expect_motion_of("take.csv", replaced(replaced(plain, ",", separator), ".", ","), kYUp);  // decimal commas
  }
}

/// Motive without its head: a table by the names of its columns, which stand in line 5.
TEST(Exports, OfMotiveWithoutHeadAreTables) {
  std::string text = motive("1.23", "Quaternion", "Meters", true);
  text.erase(0, text.find("\r\n\r\n") + 4);
  Recording r;
  r.add("take.csv", text);
  expect_motion(
      r.import(stream("time = \"field\"\ntime_field = \"Time (Seconds)\"\ncolumns = { x_m = \"robot Position X\", y_m "
                      "= \"robot Position Y\", z_m = \"robot Position Z\", qw = \"W 2\", qx = \"robot Rotation X\", qy "
                      "= \"robot Rotation Y\", qz = \"robot Rotation Z\" }\n")));
  EXPECT_EQ(r.refusal(stream(kYUp)),
            "m.toml:16:8: mocap.body: is given for a table without the head of a motion-capture program; accepted: "
            "columns, or an export with its head");
}

TEST(Exports, OfQtmGiveTheMotion) {
  for (const bool names : {true, false})
    for (const bool zeros : {true, false}) expect_motion_of("take.tsv", qtm(names, zeros), "body = \"robot\"\n");
  // each column with the body's name; decimal commas
  std::string text = qtm(true, true);
  for (const char* part : {"Y", "Z", "Roll", "Pitch", "Yaw", "Residual", "Rot[0]", "Rot[1]", "Rot[2]", "Rot[3]",
                           "Rot[4]", "Rot[5]", "Rot[6]", "Rot[7]", "Rot[8]"})
    for (const char* body : {"box ", "robot "}) {
      const std::size_t at = text.find(std::string("\t") + part + (std::string_view(part) == "Rot[8]" ? "" : "\t"),
                                       text.find(std::string(body) + "X"));
      text.insert(at + 1, body);
    }
  expect_motion_of("take.tsv", text, "body = \"robot\"\n");
  expect_motion_of("take.tsv", replaced(qtm(true, false), ".", ","), "body = \"robot\"\n");
}

TEST(Exports, OfViconGiveTheMotion) {
  for (const char* title : {"Objects", "Segments"}) {
    expect_motion_of("take.csv", vicon(title, "Quaternion", ""), "body = \"robot\"\n");
    expect_motion_of("take.csv", vicon(title, "", "rad"), "body = \"robot\"\nrotation = \"vector\"\n");
    expect_motion_of("take.csv", vicon(title, "", "deg"), "body = \"robot\"\nrotation = \"vector\"\n");
    expect_motion_of("take.csv", vicon(title, "", "deg", false), "body = \"robot\"\nrotation = \"xyz\"\n");
  }
  // several blocks, each a channel
  const std::string devices = "Devices\n1000\n,,Force,,\nFrame,Sub Frame,Fx,Fy\n,,N,N\n1,0,2,3\n1,1,2,3\n1,2,2,3\n\n";
  expect_motion_of("take.csv", devices + vicon("Objects", "Quaternion", ""), "body = \"robot\"\n", "take/Objects");
  const std::string model = replaced(replaced(devices, "Devices", "Model Outputs"), ",N,N", ",deg,deg");
  expect_motion_of("take.csv", vicon("Objects", "Quaternion", "") + "\n" + model, "body = \"robot\"\n", "take/Objects");
  // other separators; lines that a spreadsheet fills up with them
  const std::string plain = vicon("Objects", "Quaternion", "");
  expect_motion_of("take.csv", replaced(replaced(plain, ",", ";"), ".", ","), "body = \"robot\"\n");
  const std::string filled(15, ',');
  expect_motion_of("take.csv", "Objects" + filled + "\n100" + filled + plain.substr(plain.find("100\n") + 3),
                   "body = \"robot\"\n");
}

TEST(Exports, SayWhatAMappingLacks) {
  Recording r;
  r.add("take.csv", motive("1.23", "Quaternion", "Meters"));
  EXPECT_EQ(r.refusal(stream("body = \"robt\"\n")),
            "m.toml:16:8: mocap.body: \"robt\" is no rigid body of the recording; accepted: box, robot; did you mean "
            "\"robot\"?");
  EXPECT_EQ(r.refusal(stream("body = \"robot:Marker 001\"\n")),
            "m.toml:16:8: mocap.body: \"robot:Marker 001\" is no rigid body of the recording, but a marker; accepted: "
            "box, robot");
  EXPECT_EQ(r.refusal(stream("body = \"robot\"\n")),
            "m.toml:11:1: mocap.world: is missing: Motive's files do not say which axis is up; accepted: \"y_up\" (the "
            "program's default), \"enu\" (z up)");
  EXPECT_EQ(r.refusal(stream("body = \"robot\"\nworld = \"y_up\"\n")),
            "m.toml:11:1: mocap.frame: is missing: Motive's files do not say which axis of the body is forward; "
            "accepted: \"fur\" (x forward, y up), \"luf\" (z forward, y up), \"flu\" (x forward, z up), \"frd\"");
  EXPECT_EQ(r.refusal(stream(kYUp + "rotation = \"xyz\"\n")),
            "m.toml:19:12: mocap.rotation: is given, but the file says what its rotation is; accepted: no rotation");
  EXPECT_EQ(r.refusal(stream(kYUp + kPose)),
            "m.toml:19:11: mocap.columns: is given with body; accepted: one of the two");
  EXPECT_EQ(r.refusal("[mocap]\nchannel = \"motors\"\ntime = \"field\"\ntime_field = \"t\"\n" + kNoise + kYUp),
            "m.toml:18:8: mocap.body: is given for a table without the head of a motion-capture program; accepted: "
            "columns, or an export with its "
            "head");
  Recording v;
  v.add("take.csv", vicon("Objects", "", "rad"));
  EXPECT_EQ(v.refusal(stream("body = \"robot\"\n")),
            "m.toml:11:1: mocap.rotation: is missing: the file does not say what the three numbers of its rotation "
            "are; accepted: \"vector\" (axis times angle), or axes of angles in turn, as \"xyz\"");
}

TEST(Exports, ThatWereCutOffAreWarnedOf) {
  Recording r;
  std::string text = motive("1.23", "Quaternion", "Meters");
  text.resize(text.rfind("\r\n15,") + 2);
  r.add("take.csv", text);
  EXPECT_EQ(r.import(stream(kYUp)).log.mocap.t_s.size(), 14u);
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_TRUE(r.warnings[0].ends_with("take.csv: the head says 20 frames; 15 are there")) << r.warnings[0];
  Recording local;
  text.replace(text.find("Space,Global"), 12, "Space,Local");
  local.add("take.csv", text);
  EXPECT_EQ(local.refusal(stream(kYUp)), "take.csv:1:1: Coordinate Space is Local; accepted: an export with Global");
}

/// Axes of the mapping that contradict an IMU on board.
TEST(Exports, AreHeldAgainstGravity) {
  Recording r;
  r.add("take.csv", motive("1.23", "Quaternion", "Meters"));
  const auto imu = [](double up_m_s2) {
    std::string text = "t,x,y,z\n";
    for (int i = 0; i < kFrames; ++i) {
      const Eigen::Vector3d f = pose(i).q.conjugate() * Eigen::Vector3d(0, 0, up_m_s2);
      text += numbers("", {0.01 * i}) + numbers(",", {f.x(), f.y(), f.z()}) + "\n";
    }
    return text;
  };
  r.add("imu.csv", imu(9.81));
  const std::string with =
      "[imu]\nchannel = \"imu\"\ntime = \"field\"\ntime_field = \"t\"\nlatency_s = 0.0\nbandwidth_hz = "
      "80.0\nposition_m = [0.0, 0.0, 0.0]\naccel_noise_m_s2 = 0.3\ngyro = false\ncolumns = { accel_x_m_s2 = \"x\", "
      "accel_y_m_s2 = \"y\", accel_z_m_s2 = \"z\" }\n";
  expect_motion(r.import(stream(kYUp) + with));
  const std::string line = r.refusal(stream("body = \"robot\"\nworld = \"enu\"\nframe = \"fur\"\n") + with);
  EXPECT_NE(line.find("m.toml:17:9: mocap.world: the mean force on the IMU points "), std::string::npos) << line;
  EXPECT_NE(line.find("world = \"y_up\" with frame = \"fur\""), std::string::npos) << line;
  r.write("imu.csv", imu(-1));  // a fall says nothing
  expect_motion(r.import(stream(kYUp) + with));
}

/// As raw tables, too, by the names of their columns.
TEST(Exports, AreTablesWithAHead) {
  Recording r;
  r.add("take.csv", motive("1.23", "Quaternion", "Meters", true));
  expect_motion(
      r.import(stream("time = \"field\"\ntime_field = \"Time (Seconds)\"\ncolumns = { x_m = \"robot Position X\", y_m "
                      "= \"robot Position Y\", z_m = \"robot Position Z\", qw = \"W 2\", qx = \"robot Rotation X\", qy "
                      "= \"robot Rotation Y\", qz = \"robot Rotation Z\" }\n")));
}

// ---- a pose from markers

const Lines kMarkers = {"nose", "left", "right", "tail"};
const std::vector<Eigen::Vector3d> kPlaces = {
    {0.05, 0, 0.01}, {-0.04, 0.03, 0}, {-0.05, -0.02, 0.005}, {0, 0.01, 0.04}};
const std::string kInBody =
    "[mocap.markers]\nnose = [0.05, 0.0, 0.01]\nleft = [-0.04, 0.03, 0.0]\nright = [-0.05, -0.02, 0.005]\ntail = [0.0, "
    "0.01, 0.04]\n";

/// Markers in mm of a pose, of which `names` swaps the first two at frame 3, and one is lost at frame 5; none at kLost.
std::string marker_cells(const Pose& at, int i, const char* separator, bool zeros) {
  std::string text;
  for (std::size_t k = 0; k < kPlaces.size(); ++k) {
    const std::size_t of = i == 3 && k < 2 ? 1 - k : k;
    const Eigen::Vector3d p = 1e3 * (at.p + at.q * kPlaces[of]);
    const bool lost = i == kLost || (i == 5 && k == 2);
    if (lost)
      for (int c = 0; c < 3; ++c) text += separator + std::string(zeros ? "0.000" : "");
    else text += numbers(separator, {p.x(), p.y(), p.z()});
  }
  return text;
}

std::string qtm_3d(bool names) {
  std::string text =
      "NO_OF_FRAMES\t20\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t4\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES";
  for (const std::string& name : kMarkers) text += "\t" + name;
  text += "\n";
  if (names) text += "Frame\tTime";
  for (const std::string& name : kMarkers)
    if (names) text += "\t" + name + " X\t" + name + " Y\t" + name + " Z";
  if (names) text += "\n";
  for (int i = 0; i < kFrames; ++i) {
    const std::string cells = marker_cells(pose(i), i, "\t", true);
    text += names ? std::to_string(i + 1) + numbers("\t", {0.01 * i}, 5) + cells + "\n" : cells.substr(1) + "\n";
  }
  return text;
}

std::string nexus(bool at_rest = false) {
  std::string text = "Trajectories\n100\n,", axes = "\nFrame,Sub Frame", units = "\n,";
  for (const std::string& name : kMarkers) text += "," + name + ",,", axes += ",X,Y,Z", units += ",mm,mm,mm";
  text += axes + units + "\n";
  // at rest: B's origin at (1, 2, 0.03), turned by 0.5 rad
  const Pose rest{{1, 2, 0.03}, exponential({0, 0, 0.5})};
  for (int i = 0; i < kFrames; ++i)
    text += std::to_string(i + 1) + ",0" + marker_cells(at_rest ? rest : pose(i), at_rest ? 0 : i, ",", false) + "\n";
  return text;
}

TEST(Exports, OfMarkersGiveThePose) {
  for (const std::string& text : {qtm_3d(true), qtm_3d(false), nexus()}) {
    SCOPED_TRACE(text.substr(0, 100));
    Recording r;
    r.add(text.starts_with("NO_") ? "take.tsv" : "take.csv", text);
    const Imported imported = r.import(stream("") + kInBody);
    expect_motion(imported);
    EXPECT_EQ(imported.report.warnings,
              (Lines{"mocap: 1 frame with left and nose swapped: put right",
                     "mocap: 1 frame in which left was not seen", "mocap: 1 frame in which nose was not seen",
                     "mocap: 2 frames in which right was not seen", "mocap: 1 frame in which tail was not seen",
                     "mocap: 1 samples are unusable: 1 no pose agrees with the markers"}));
    const StreamReport& report = imported.report.streams[1];
    ASSERT_EQ(report.residual_m.size(), kFrames - 1u);
    for (const double residual_m : report.residual_m) EXPECT_LT(residual_m, 1e-9);  // mm with 9 digits
  }
}

TEST(Exports, AtRestGiveThePlacesOfMarkers) {
  Recording r;
  r.add("take.csv", nexus());
  r.write("rest.csv", nexus(true));
  const std::string names = "markers = [\"nose\", \"left\", \"right\", \"tail\"]\n";
  expect_motion(
      r.import(stream(names) + "[mocap.at_rest]\nfile = \"rest.csv\"\nposition_m = [1.0, 2.0, 0.03]\nyaw_rad = 0.5\n"));
  EXPECT_EQ(r.refusal(stream("markers = [\"nose\", \"left\"]\n") +
                      "[mocap.at_rest]\nfile = \"rest.csv\"\nposition_m = [1.0, 2.0, 0.03]\n"),
            "m.toml:16:11: mocap.markers: has 2 markers; accepted: at least 3 that are not in one line");
  EXPECT_EQ(r.refusal(stream("markers = [\"nose\", \"left\", \"rigt\"]\n") +
                      "[mocap.at_rest]\nfile = \"rest.csv\"\nposition_m = [1.0, 2.0, 0.03]\n"),
            "m.toml:16:11: mocap.markers: \"rigt\" is no marker of the recording; accepted: nose, left, right, tail; "
            "did you mean \"right\"?");
  EXPECT_EQ(r.refusal(stream("frame = \"flu\"\n") + kInBody),
            "m.toml:16:9: mocap.frame: is given with markers, whose places are in B; accepted: no frame");
  EXPECT_EQ(r.refusal(stream("body = \"robot\"\ntolerance_m = 0.1\n")),
            "m.toml:17:15: mocap.tolerance_m: is given without markers; accepted: markers");
  EXPECT_EQ(r.refusal(stream("") +
                      "[mocap.markers]\nnose = [0.0, 0.0, 0.0]\nleft = [0.1, 0.0, 0.0]\ntail = [0.2, 0.0, 0.0]\n"),
            "m.toml:16:1: mocap.markers: are in one line; accepted: at least 3 that are not");
}

// ---- one flight, eleven files

/// Markers as Motive has them, in mm, z up.
std::string motive_markers() {
  std::string text =
      "Format Version,1.23,Take Name,hover,Export Frame Rate,100.000000,Total Exported Frames,20,Rotation "
      "Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\r\n\r\n";
  Lines rows = {",Type", ",Name", ",ID", ",", "Frame,Time (Seconds)"};
  for (const std::string& name : kMarkers)
    for (const char* axis : {"X", "Y", "Z"}) {
      const Lines cells = {"Marker", name, "1", "Position", axis};
      for (std::size_t k = 0; k < rows.size(); ++k) rows[k] += "," + cells[k];
    }
  for (const std::string& row : rows) text += row + "\r\n";
  for (int i = 0; i < kFrames; ++i)
    text += std::to_string(i) + numbers(",", {0.01 * i}, 6) + marker_cells(pose(i), i, ",", false) + "\r\n";
  return text;
}

std::string c3d() {
  test::C3dText text(test::Processor::intel, true);
  text.group(1, "POINT").integers(1, "USED", {4}).reals(1, "SCALE", {-0.1}).reals(1, "RATE", {100});
  text.integers(1, "FRAMES", {kFrames}).texts(1, "LABELS", kMarkers).texts(1, "UNITS", {"mm"});
  text.integers(1, "DATA_START", {text.data_block()});
  std::string data;
  for (int i = 0; i < kFrames; ++i)
    for (const Eigen::Vector3d& place : kPlaces) {
      const Eigen::Vector3d p = 1e3 * (pose(i).p + pose(i).q * place);
      data += text.real(p.x()) + text.real(p.y()) + text.real(p.z()) + text.real(i == kLost ? -1 : 0x0301);
    }
  return text.file(4, 0, 0, kFrames, -0.1, 100, data);
}

/// Times, places and quaternions column by column, not numbers where the robot was lost.
struct MotionColumns {
  Column t, position, quaternion;
  MotionColumns() : position(3 * kFrames), quaternion(4 * kFrames) {
    for (int i = 0; i < kFrames; ++i) {
      const Pose at = pose(i);
      const std::array<double, 4> q = {at.q.w(), at.q.x(), at.q.y(), at.q.z()};
      t.push_back(0.01 * i);
      for (int k = 0; k < 4; ++k) {
        if (k < 3) position[k * kFrames + i] = i == kLost ? std::nan("") : at.p[k];
        quaternion[k * kFrames + i] = i == kLost ? std::nan("") : q[k];
      }
    }
  }
};

std::string matlab(bool packed) {
  const MotionColumns motion;
  test::MatText mat;
  const std::string flight = mat.structs("flight", 1, {"t", "position", "q"},
                                         {mat.column("", motion.t), mat.doubles("", {kFrames, 3}, motion.position),
                                          mat.doubles("", {kFrames, 4}, motion.quaternion)});
  return mat.add(packed ? mat.compressed(flight) : flight).text;
}

void write_matlab_73(const std::filesystem::path& file) {
  using test::Mat73;
  const MotionColumns motion;
  Mat73 mat(file);
  const hid_t flight = Mat73::group(mat.file, "flight");
  Mat73::add(flight, "t", {kFrames, 1}, motion.t);
  Mat73::add(flight, "position", {kFrames, 3}, motion.position, "double", H5T_STR_NULLTERM, true);
  Mat73::add(flight, "q", {kFrames, 4}, motion.quaternion);
  H5Gclose(flight);
}

/// What a log on board has of each frame but the lost one: time in us, then floats.
template <class Begin>
std::string on_board(const Begin& begin) {
  std::string text;
  for (int i = 0; i < kFrames; ++i) {
    if (i == kLost) continue;
    const Pose at = pose(i);
    text += begin() + test::UlogText::bytes(static_cast<std::uint64_t>(10'000 * i));
    for (const double v : {at.p.x(), at.p.y(), at.p.z(), at.q.w(), at.q.x(), at.q.y(), at.q.z()})
      text += test::UlogText::bytes(static_cast<float>(v));
  }
  return text;
}

std::string dataflash() {
  const auto fmt = [](int type, int size, std::string name, std::string letters, std::string columns) {
    name.resize(4), letters.resize(16), columns.resize(64);
    return std::string("\xA3\x95\x80") + static_cast<char>(type) + static_cast<char>(size) + name + letters + columns;
  };
  return fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
         fmt(129, 3 + 8 + 7 * 4, "POSE", "Qfffffff", "TimeUS,x,y,z,qw,qx,qy,qz") +
         on_board([] { return "\xA3\x95\x81"; });
}

std::string usdlog() {
  std::string text = "\xBC" + test::UlogText::bytes(std::uint16_t{2}) + test::UlogText::bytes(std::uint16_t{1}) +
                     test::UlogText::bytes(std::uint16_t{5}) + "estPose" + '\0' +
                     test::UlogText::bytes(std::uint16_t{7});
  for (const char* name : {"x", "y", "z", "qw", "qx", "qy", "qz"}) text += std::string(name) + "(f)" + '\0';
  text += on_board([] { return test::UlogText::bytes(std::uint16_t{5}); });
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  return text + test::UlogText::bytes(static_cast<std::uint32_t>(sum));
}

std::string plain_table() {
  std::string text = "t,x,y,z,qw,qx,qy,qz\n";
  for (int i = 0; i < kFrames; ++i) {
    const Pose at = pose(i);
    if (i == kLost) continue;
    text += numbers("", {0.01 * i}, 3) +
            numbers(",", {at.p.x(), at.p.y(), at.p.z(), at.q.w(), at.q.x(), at.q.y(), at.q.z()}) + "\n";
  }
  return text;
}

TEST(Exports, OneFlightInElevenFilesIsOneMotion) {
  const std::string field = "time = \"field\"\ntime_field = \"t\"\n", body = "body = \"robot\"\n",
                    arrays = field +
                             "columns = { x_m = \"position[0]\", y_m = \"position[1]\", z_m = \"position[2]\", qw = "
                             "\"q[0]\", qx = \"q[1]\", qy = \"q[2]\", qz = \"q[3]\" }\n";
  // text has 9 digits; singles have 24 bits, which turn markers 5 cm apart by 2^-24 * 1.5 / 0.05 each
  constexpr double kText = 1e-8, kSingle = 2e-7, kSingleMarkers = 4 * 1.5 / 0.05 * 6e-8;
  struct File {
    std::string name, text, channel, mapping;
    double tolerance;
  };
  const std::vector<File> files = {
      {"take.csv", motive("1.23", "Quaternion", "Meters"), "take", kYUp, kText},
      {"take.csv", motive_markers(), "take", "world = \"enu\"\n" + kInBody, kText},
      {"take.tsv", qtm_3d(true), "take", kInBody, kText},
      {"take.tsv", qtm(true, true), "take", body, kText},
      {"take.csv", vicon("Objects", "Quaternion", ""), "take", body, kText},
      {"take.c3d", c3d(), "take", "world = \"enu\"\n" + kInBody, kSingleMarkers},
      {"take.mat", matlab(false), "flight", arrays, 1e-12},
      {"take.mat", "", "flight", arrays, 1e-12},  // version 7.3
      {"log.bin", dataflash(), "POSE", kPose, kSingle},
      {"log00", usdlog(), "estPose", kPose, kSingle},
      {"camera.csv", plain_table(), "camera", field + kPose, kText},
  };
  ASSERT_EQ(files.size(), 11u);
  for (const File& file : files) {
    SCOPED_TRACE(file.name + file.text.substr(0, 60));
    Recording r;
    if (file.text.empty()) write_matlab_73(r.place(file.name));
    else r.add(file.name, file.text);
    expect_motion(r.import(stream(file.mapping, file.channel)), file.tolerance);
    EXPECT_EQ(r.warnings, Lines());
  }
  Recording packed;  // version 7
  packed.add("take.mat", matlab(true));
  expect_motion(packed.import(stream(arrays, "flight")), 1e-12);
  Recording c3d_without_up;
  c3d_without_up.add("take.c3d", c3d());
  EXPECT_EQ(c3d_without_up.refusal(stream("") + kInBody),
            "m.toml:11:1: mocap.world: is missing: C3D's files do not say which axis is up; accepted: \"enu\" (z up), "
            "\"y_up\"");
}

}  // namespace
}  // namespace flappy::flightlog::exports_test
