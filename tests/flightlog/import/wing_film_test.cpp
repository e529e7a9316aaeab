// Wings by digitised points: known angles to points in the shapes of digitisers, and back.
#include "flightlog/import/wing_film.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "flightlog/import/import_files.hpp"
#include "flightlog/import/mapping.hpp"
#include "flightlog/rotation.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"
#include "model/hinged_wing.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::flightlog::wing_film_test {
namespace {

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;

constexpr double kLength_m = 0.07, kBehind_m = 0.02, kShare = 0.6;  // trailing point: behind the axis, along it
constexpr double kRate_hz = 2000, kBeat_hz = 34, kPlane_rad = 0.15;
constexpr int kFrames = 400;

Matrix about(int axis, double angle) { return Eigen::AngleAxisd(angle, Vector::Unit(axis)).toRotationMatrix(); }

/// Analytic angles: a stroke of a right angle and more, a rotation of 45 degrees, a small deviation; left unlike right.
WingAngles angles_at(int frame, std::size_t side) {
  const double p = 2 * std::numbers::pi * kBeat_hz * frame / kRate_hz + (side == 0 ? 0 : 0.3);
  return {1.1 * std::cos(p) + 0.1, 0.8 * std::sin(p) - 0.05, 0.04 * std::sin(2 * p)};
}

/// E of the frame, as the equations have it, written apart from what is tested.
WingPoints points_in_body(int side, const WingAngles& a, double plane_rad) {
  const Matrix edge = about(1, -plane_rad) * about(2, side * a.stroke_rad) * about(0, side * a.deviation_rad);
  const Matrix wing = edge * about(1, a.rotation_rad);
  const Vector root(0.01, side * 0.015, 0.02);
  return {root, root + wing * Vector(0, side * kLength_m, 0),
          root + wing * Vector(0, side * kShare * kLength_m, -kBehind_m)};
}

Eigen::Quaterniond attitude_at(int frame) { return exponential({0.3, -0.2 + 1e-3 * frame, 1 + 2e-3 * frame}); }
Vector position_at(int frame) { return {1 + 1e-3 * frame, -2, 0.5}; }

const std::vector<std::string> kNames = {"pt1", "pt2", "pt3", "pt4", "pt5", "pt6"};

FilmedFrame frame_at(int frame, double plane_rad = 0) {
  FilmedFrame f;
  f.attitude = attitude_at(frame);
  for (const std::size_t side : {0, 1}) {
    const WingPoints in_body = points_in_body(side == 0 ? 1 : -1, angles_at(frame, side), plane_rad);
    const auto seen = [&](const Vector& p) -> Vector { return *f.attitude * p + position_at(frame); };
    f.wings[side] = {seen(in_body.root), seen(in_body.tip), seen(in_body.trailing)};
  }
  return f;
}

std::vector<FilmedFrame> film(double plane_rad = 0) {
  std::vector<FilmedFrame> frames;
  for (int i = 0; i < kFrames; ++i) frames.push_back(frame_at(i, plane_rad));
  return frames;
}

FilmedWings read(const std::vector<FilmedFrame>& frames, double plane_rad = 0) {
  return filmed_wings(frames, kNames, plane_rad, 0.1);
}

TEST(WingFilm, HasTheSignsOfTheConventions) {
  for (const int side : {1, -1}) {
    const double y = side;
    // at rest: along y, its trailing edge below
    const WingAngles rest = wing_angles(side, {{0, 0, 0}, {0, y, 0}, {0, 0.5 * y, -1}}, 0);
    EXPECT_NEAR(rest.stroke_rad, 0, 1e-15);
    EXPECT_NEAR(rest.rotation_rad, 0, 1e-15);
    EXPECT_NEAR(rest.deviation_rad, 0, 1e-15);
    // the tip 30 degrees backward: stroke above 0 on both sides
    const double b = std::numbers::pi / 6;
    EXPECT_NEAR(wing_angles(side, {{0, 0, 0}, {-std::sin(b), y * std::cos(b), 0}, {0, 0, -1}}, 0).stroke_rad, b, 1e-15);
    // the trailing edge backward: rotation above 0; the tip up: deviation above 0
    EXPECT_NEAR(wing_angles(side, {{0, 0, 0}, {0, y, 0}, {-std::sin(b), 0, -std::cos(b)}}, 0).rotation_rad, b, 1e-15);
    EXPECT_NEAR(wing_angles(side, {{0, 0, 0}, {0, y * std::cos(b), std::sin(b)}, {-1, 0, 0}}, 0).deviation_rad, b,
                1e-15);
  }
}

TEST(WingFilm, GivesTheAnglesBack) {
  for (const double plane : {0.0, kPlane_rad}) {
    const FilmedWings wings = read(film(plane), plane);
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_EQ(wings.faults[i], "") << i;
      for (const std::size_t side : {0, 1}) {
        const WingAngles expected = angles_at(i, side), got = wings.angles[i][side];
        // coordinates of 3 m, rounded to 4e-16 m, at distances of 0.02 m
        EXPECT_NEAR(got.stroke_rad, expected.stroke_rad, 2e-13);
        EXPECT_NEAR(got.rotation_rad, expected.rotation_rad, 2e-13);
        EXPECT_NEAR(got.deviation_rad, expected.deviation_rad, 2e-13);
      }
    }
    EXPECT_LT(wings.stroke_noise_rad, 1e-13);
  }
}

/// Where the kernels that fly put a point of a wing: by its mass moment about the shoulder, of hinged wings; and by the
/// turns of articulated ones.
TEST(WingFilm, AgreesWithTheSimulatorsFrames) {
  using Vec = model::Vec3<double>;
  const auto sc = [](double angle) { return std::pair(std::sin(angle), std::cos(angle)); };
  const auto turned = [&](int side, const WingAngles& a, double plane, Vec v) {
    const auto [st, ct] = sc(a.rotation_rad);
    const auto [sd, cd] = sc(side * a.deviation_rad);
    const auto [sb, cb] = sc(side * a.stroke_rad);
    const auto [sp, cp] = sc(-plane);
    v = model::rotate_z(sb, cb, model::rotate_x(sd, cd, model::rotate_y(st, ct, v)));
    v = model::rotate_y(sp, cp, v);
    return Vector(v.x, v.y, v.z);
  };
  const auto hinged = [](auto side, const WingAngles& a, Vec v) {
    model::SideParameters<double> p{};
    p.wing_moment_kg_m = v;
    model::SideState<double> q{};
    q.stroke_rad = a.stroke_rad, q.rotation_rad = a.rotation_rad;
    const Vec at = model::moment_about_shoulder<decltype(side)::value>(p, q);
    return Vector(at.x, at.y, at.z);
  };
  const auto expect = [](int side, const WingAngles& a, double plane, const auto& place) {
    const double s = side;
    const WingAngles got = wing_angles(side, {{0, 0, 0}, place({0, s * 0.07, 0}), place({0, s * 0.04, -0.02})}, plane);
    EXPECT_NEAR(got.stroke_rad, a.stroke_rad, 1e-13);
    EXPECT_NEAR(got.deviation_rad, a.deviation_rad, 1e-13);
    EXPECT_NEAR(got.rotation_rad, a.rotation_rad, 1e-13);
  };
  for (const WingAngles a : {WingAngles{0.7, -0.6, 0}, WingAngles{-1.2, 0.9, 0}}) {
    expect(1, a, 0, [&](Vec v) { return hinged(std::integral_constant<int, 1>(), a, v); });
    expect(-1, a, 0, [&](Vec v) { return hinged(std::integral_constant<int, -1>(), a, v); });
  }
  for (const int side : {1, -1})
    for (const WingAngles a : {WingAngles{0.7, -0.6, 0.1}, WingAngles{-1.2, 0.9, -0.2}})
      expect(side, a, kPlane_rad, [&](Vec v) { return turned(side, a, kPlane_rad, v); });
}

/// Noise of 0.5 mm gives the errors that the head of wing_film.hpp predicts: standard deviations of 400 frames of two wings
/// have a standard error of 1/sqrt(2 * 800) = 2.5 %; 10 % is four of them. The deviation of 0.04 rad changes them by less.
TEST(WingFilm, PassesNoiseOnAsPredicted) {
  constexpr double kNoise_m = 0.5e-3;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0, kNoise_m);
  std::vector<FilmedFrame> frames = film();
  for (FilmedFrame& f : frames)
    for (WingPoints& w : f.wings)
      for (Vector* p : {&w.root, &w.tip, &w.trailing}) *p += Vector(normal(random), normal(random), normal(random));
  const FilmedWings wings = read(frames);
  double stroke = 0, rotation = 0, deviation = 0, count = 0, mean = 0;
  for (int i = 0; i < kFrames; ++i) {
    if (!wings.faults[i].empty()) continue;
    for (const std::size_t side : {0, 1}) {
      const WingAngles e = angles_at(i, side), got = wings.angles[i][side];
      stroke += std::pow(got.stroke_rad - e.stroke_rad, 2), rotation += std::pow(got.rotation_rad - e.rotation_rad, 2);
      deviation += std::pow(got.deviation_rad - e.deviation_rad, 2), mean += got.stroke_rad - e.stroke_rad, ++count;
    }
  }
  EXPECT_GT(count,
            1.9 * kFrames);  // a length of 20 mm with noise of 0.7 mm is beyond a tenth of it in 0.5 % of the frames
  const double along = std::sqrt(2) * kNoise_m / kLength_m;
  const double behind = kNoise_m * std::sqrt(1 + std::pow(1 - kShare, 2) + std::pow(kShare, 2)) / kBehind_m;
  EXPECT_NEAR(std::sqrt(stroke / count), along, 0.1 * along);
  EXPECT_NEAR(std::sqrt(deviation / count), along, 0.1 * along);
  EXPECT_NEAR(std::sqrt(rotation / count), behind, 0.1 * behind);
  EXPECT_NEAR(wings.stroke_noise_rad, along, 0.1 * along);
  EXPECT_LT(std::abs(mean / count), 4 * along / std::sqrt(count));
}

TEST(WingFilm, LeavesOutWhatIsImplausible) {
  const Vector gone = Vector::Constant(std::nan(""));
  std::vector<FilmedFrame> frames = film();
  std::vector<std::string> expected(kFrames);
  const auto spoil = [&](int i, const std::string& fault) -> FilmedFrame& { return expected[i] = fault, frames[i]; };
  for (int i = 0; i < 40; ++i) spoil(i, "without pt2").wings[0].tip = gone;
  for (int i = 40; i < 60; ++i) spoil(i, "without pt6").wings[1].trailing = gone;
  for (int i = 60; i < 100; ++i) {
    FilmedFrame& f = spoil(i, "with left and right wing swapped");
    std::swap(f.wings[0], f.wings[1]);
  }
  const std::string left = "with left points at distances that are not the wing's",
                    right = "with right points at distances that are not the wing's";
  for (int i = 100; i < 110; ++i) {
    FilmedFrame& f = spoil(i, left);
    std::swap(f.wings[0].tip, f.wings[1].tip);
  }
  for (int i = 110; i < 120; ++i) {
    FilmedFrame& f = spoil(i, right);
    std::swap(f.wings[1].tip, f.wings[1].trailing);
  }
  for (int i = 120; i < 130; ++i) {
    WingPoints& w = spoil(i, left).wings[0];
    w.tip = w.root + 1.11 * (w.tip - w.root);
  }
  spoil(130, "without attitude of the body").attitude.reset();
  const FilmedWings wings = read(frames);
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(wings.faults[i], expected[i]) << i;
    if (!expected[i].empty()) EXPECT_TRUE(std::isnan(wings.angles[i][0].stroke_rad));
    else EXPECT_NEAR(wings.angles[i][0].stroke_rad, angles_at(i, 0).stroke_rad, 1e-13);
  }
  EXPECT_EQ(wings.swapped, 40u);
  EXPECT_EQ(wings.whole, kFrames - 61u);
  // a length that differs by less than the bound stays
  frames = film();
  frames[0].wings[0].tip = frames[0].wings[0].root + 1.05 * (frames[0].wings[0].tip - frames[0].wings[0].root);
  EXPECT_EQ(read(frames).faults[0], "");
  // a trailing point on the axis shows no rotation
  frames = film();
  for (FilmedFrame& f : frames) f.wings[1].trailing = f.wings[1].root + 0.5 * (f.wings[1].tip - f.wings[1].root);
  EXPECT_EQ(read(frames).faults[5], "with pt6 in line with root and tip");
}

// ---- from files

const std::string kHead =
    "schema = 1\nvehicle = \"bird.toml\"\nflapping_Hz = 34.0\ngravity_m_s2 = 9.81\n"
    "ambient = { air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }\n"
    "[command]\nchannel = \"motors\"\ntime = \"field\"\ntime_field = \"t\"\n"
    "columns = { left_voltage_V = \"l\", right_voltage_V = \"r\" }\n";
const std::string kRig =
    "[rig]\nsupport = \"clamped\"\nchannel = \"forces\"\ntime = \"field\"\ntime_field = \"t\"\nlatency_s = 0.0\n"
    "position_m = [0.0, 0.0, 0.0]\nattitude = [1.0, 0.0, 0.0, 0.0]\nforce_noise_N = 1e-3\nmoment_noise_Nm = 1e-5\n"
    "columns = { force_x_N = \"x\", force_y_N = \"x\", force_z_N = \"x\", moment_x_Nm = \"x\", moment_y_Nm = \"x\", "
    "moment_z_Nm = \"x\" }\n";
const std::string kWings =
    "[wings]\nchannel = \"flightxyzpts\"\ntime = \"frame\"\nframe_rate_hz = 2000.0\nnoise_rad = 0.01\nunit_m = 1e-3\n";
const std::string kPoints =
    "points = { left_root = \"pt1\", left_tip = \"pt2\", left_trailing = \"pt3\", right_root = \"pt4\", right_tip = "
    "\"pt5\", right_trailing = \"pt6\" }\n";
const std::vector<Vector> kBody = {{0.05, 0, 0.01}, {-0.04, 0.03, 0}, {-0.05, -0.02, 0.005}};  // pt7, pt8, pt9
const std::string kMarkers =
    "markers = { pt7 = [0.05, 0.0, 0.01], pt8 = [-0.04, 0.03, 0.0], pt9 = [-0.05, -0.02, 0.005] }\n";

/// Frame `i`: the points of the wings, then those of the body, m; of a clamped robot in its own pose.
std::vector<Vector> points_at(int i, bool clamped = false) {
  const FilmedFrame f = frame_at(i);
  std::vector<Vector> points;
  for (const WingPoints& w : f.wings) points.insert(points.end(), {w.root, w.tip, w.trailing});
  for (const Vector& place : kBody) points.push_back(attitude_at(i) * place + position_at(i));
  if (clamped)
    for (Vector& p : points) p = attitude_at(0) * (attitude_at(i).conjugate() * (p - position_at(i))) + position_at(0);
  return points;
}

bool is_occluded(int i, std::size_t point) { return i < 20 || (i % 7 == 3 && point == 4); }

class Film {
 public:
  Film() {
    std::string motors = "t,l,r\n", forces = "t,x\n";
    for (int i = 0; i < kFrames; ++i) {
      motors += io::format("%.4f,1,1\n", i / kRate_hz), forces += io::format("%.4f,0\n", i / kRate_hz);
    }
    add("motors.csv", motors);
    add("forces.csv", forces);
  }
  void add(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    files_.push_back(folder_ / name);
  }
  Imported import(const std::string& streams) {
    std::ofstream(folder_ / "m.toml") << kHead << streams;
    Imported imported = import_files(folder_ / "m.toml", files_, warnings);
    warnings.insert(warnings.end(), imported.report.warnings.begin(), imported.report.warnings.end());
    return imported;
  }
  std::string refusal(const std::string& streams) {
    std::string line = test::refusal([&] { import(streams); });
    const std::string folder = folder_.path().string() + "/";
    for (std::size_t at = 0; (at = line.find(folder)) != std::string::npos;) line.erase(at, folder.size());
    return line;
  }

  std::vector<std::string> warnings;

 private:
  io::TemporaryFolder folder_;
  std::vector<std::filesystem::path> files_;
};

/// xyzpts.csv of DLTdv: in mm, a row for each frame, NaN for what was not digitised.
std::string xyzpts(bool clamped) {
  std::string text;
  for (int k = 1; k <= 9; ++k)
    for (const char axis : {'X', 'Y', 'Z'}) text += (text.empty() ? "pt" : ",pt") + std::to_string(k) + "_" + axis;
  text += "\n";
  for (int i = 0; i < kFrames; ++i) {
    const std::vector<Vector> points = points_at(i, clamped);
    for (std::size_t k = 0; k < points.size(); ++k)
      for (int axis = 0; axis < 3; ++axis)
        text += (k + axis > 0 ? "," : "") +
                (is_occluded(i, k) ? std::string("NaN") : io::format("%.9f", 1e3 * points[k][axis]));
    text += "\n";
  }
  return text;
}

/// The same in DLTdv8's sparse form: column by column, from 1, with six digits.
std::string sparse(bool clamped) {
  std::string entries;
  int count = 0;
  for (std::size_t k = 0; k < 9; ++k)
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kFrames; ++i)
        if (!is_occluded(i, k)) {
          entries += io::format("%d\t%d\t%.6f\n", i + 1, static_cast<int>(3 * k) + axis + 1,
                                1e3 * points_at(i, clamped)[k][axis]);
          ++count;
        }
  return "% xyz points\n" + io::format("%d\t%d\t%d\n", kFrames, 27, count) + entries;
}

void expect_angles(const Imported& imported, double tolerance) {
  ASSERT_TRUE(imported.log.wings);
  const WingsStream& w = *imported.log.wings;
  std::vector<int> seen;
  for (int i = 0; i < kFrames; ++i)
    if (!is_occluded(i, 4)) seen.push_back(i);
  ASSERT_EQ(w.t_s.size(), seen.size());
  EXPECT_NEAR(imported.log.header.wings->rate_hz, kRate_hz, 1e-6);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const WingAngles left = angles_at(seen[k], 0), right = angles_at(seen[k], 1);
    EXPECT_NEAR(w.t_s[k], seen[k] / kRate_hz, 1e-9);
    EXPECT_NEAR(w.left_stroke_rad[k], left.stroke_rad, tolerance);
    EXPECT_NEAR(w.left_rotation_rad[k], left.rotation_rad, tolerance);
    EXPECT_NEAR(w.right_stroke_rad[k], right.stroke_rad, tolerance);
    EXPECT_NEAR(w.right_rotation_rad[k], right.rotation_rad, tolerance);
  }
  const StreamReport& report = imported.report.streams.back();
  EXPECT_EQ(report.stream, "wings");
  EXPECT_EQ(report.unusable, kFrames - seen.size());
  EXPECT_EQ(report.why_unusable.at("without pt1"), 20u);
  EXPECT_EQ(report.why_unusable.at("without pt5"), kFrames - seen.size() - 20);
  EXPECT_NEAR(*std::max_element(report.deviation_rad.begin(), report.deviation_rad.end()), 0.04, 1e-3);
}

/// Coordinates rounded to 1e-12 m at distances of 0.02 m; in the sparse form to 1e-9 m. Rounding of the pose's four
/// points of the body adds as much.
TEST(WingFilm, IsReadFromBothFormsOfDltdv) {
  Film csv, tsv;
  csv.add("flightxyzpts.csv", xyzpts(true));
  tsv.add("flightxyzpts.tsv", sparse(true));
  expect_angles(csv.import(kRig + kWings + kPoints + kMarkers), 1e-9);
  ASSERT_FALSE(csv.warnings.empty());
  EXPECT_EQ(csv.warnings.back(), "wings: 74 samples are unusable: 20 without pt1, 54 without pt5");
  expect_angles(tsv.import(kRig + kWings + kPoints + kMarkers), 5e-7);
  // the attitude of a clamped robot, in place of points of its body
  const Eigen::Quaterniond q = attitude_at(0).conjugate();
  const std::string attitude = io::format("attitude = [%.15f, %.15f, %.15f, %.15f]\n", q.w(), q.x(), q.y(), q.z());
  expect_angles(csv.import(kRig + kWings + attitude + kPoints), 1e-9);
}

/// A robot that flies: its pose comes from points of its body in the same film, or from motion capture that is slower and
/// late. Between its samples of 5 ms the attitude turns by 0.02 rad, along an arc whose sagitta is 0.02^2/8 rad.
TEST(WingFilm, TakesTheAttitudeOfMotionCapture) {
  constexpr double kLatency_s = 0.004;
  Film film;
  film.add("flightxyzpts.csv", xyzpts(false));
  std::string accelerations = "t,o,u\n", poses = "t,x,qw,qx,qy,qz\n";
  for (int i = 0; i < kFrames; ++i) accelerations += io::format("%.4f,0,9.81\n", i / kRate_hz);
  for (int i = 0; i < kFrames + 20; i += 10) {
    const Eigen::Quaterniond q = attitude_at(i);
    poses += io::format("%.4f,1,%.12f,%.12f,%.12f,%.12f\n", i / kRate_hz + kLatency_s, q.w(), q.x(), q.y(), q.z());
  }
  film.add("imu.csv", accelerations);
  film.add("poses.csv", poses);
  const std::string imu =
      "[imu]\nchannel = \"imu\"\ntime = \"field\"\ntime_field = \"t\"\nlatency_s = 0.0\nbandwidth_hz = 100.0\n"
      "position_m = [0.0, 0.0, 0.0]\ngyro_noise_rad_s = 0.0\ngyro_bias_sd_rad_s = [0.0, 0.0, 0.0]\n"
      "accel_noise_m_s2 = 0.0\ncolumns = { gyro_x_rad_s = \"o\", gyro_y_rad_s = \"o\", gyro_z_rad_s = \"o\", "
      "accel_x_m_s2 = \"o\", accel_y_m_s2 = \"o\", accel_z_m_s2 = \"u\" }\n";
  const std::string noise = "position_noise_m = 1e-4\nattitude_noise_rad = 5e-3\n";
  const std::string same =
      "[mocap]\nchannel = \"flightxyzpts\"\ntime = \"frame\"\nframe_rate_hz = 2000.0\nunit_m = "
      "1e-3\nlatency_s = 0.0\n" +
      noise + kMarkers;
  const std::string late = "[mocap]\nchannel = \"poses\"\ntime = \"field\"\ntime_field = \"t\"\nlatency_s = 0.004\n" +
                           noise +
                           "columns = { x_m = \"x\", y_m = \"x\", z_m = \"x\", qw = \"qw\", qx = \"qx\", qy = \"qy\", "
                           "qz = \"qz\" }\n";
  for (const auto& [mocap, tolerance] : {std::pair(same, 1e-9), std::pair(late, 0.02 * 0.02 / 8)}) {
    const Imported imported = film.import(mocap + imu + kWings + kPoints);
    if (mocap == same) {
      EXPECT_NEAR(imported.log.mocap.x_m.back(), position_at(kFrames - 1).x(), 1e-9);
    }
    expect_angles(imported, tolerance);
  }
  EXPECT_NE(film.refusal(same + imu + kWings + kPoints + "attitude = [1.0, 0.0, 0.0, 0.0]\n")
                .find("wings.attitude: is given for a robot that flies; accepted: markers, or none: that of mocap"),
            std::string::npos);
}

TEST(WingFilm, CountsFramesOfRowsThatAreLeftOut) {
  Film film;
  std::string text = xyzpts(true);
  // line 100, frame 98, lacks a cell: it is left out, and the others keep their times
  std::size_t at = 0;
  for (int line = 1; line < 100; ++line) at = text.find('\n', at) + 1;
  text.erase(at, text.find(',', at) + 1 - at);
  film.add("flightxyzpts.csv", text);
  const Imported imported = film.import(kRig + kWings + kPoints + kMarkers);
  const WingsStream& w = *imported.log.wings;
  EXPECT_NEAR(w.t_s.back(), (kFrames - 1) / kRate_hz, 1e-9);
  EXPECT_NEAR(w.left_stroke_rad.back(), angles_at(kFrames - 1, 0).stroke_rad, 1e-9);
}

TEST(WingFilm, HasAMappingToBeginWith) {
  const Mapping mapping = read_mapping(test::source_path("configs/mapping/dltdv.toml"));
  EXPECT_EQ(mapping.streams.back().name, "wings");
  EXPECT_EQ(mapping.streams.back().points, kNames);
  EXPECT_EQ(mapping.streams[1].markers, (std::vector<std::string>{"pt7", "pt8", "pt9"}));
  EXPECT_TRUE(mapping.wanted().at("takexyzpts").contains("pt9_Z"));
}

TEST(WingFilm, RefusesWhatCannotBe) {
  Film film;
  film.add("flightxyzpts.csv", xyzpts(true));
  const auto points = [](const std::string& right_tip, const std::string& left_root = "pt1",
                         const std::string& right_root = "pt4") {
    return "points = { left_root = \"" + left_root +
           "\", left_tip = \"pt2\", left_trailing = \"pt3\", right_root = \"" + right_root + "\", right_tip = \"" +
           right_tip + "\", right_trailing = \"pt6\" }\n";
  };
  const auto expect = [&](const std::string& wings, const std::string& line) {
    EXPECT_NE(film.refusal(kRig + wings).find(line), std::string::npos) << film.refusal(kRig + wings);
  };
  expect(kWings + points("pt11") + kMarkers,
         "wings.points: \"pt11\" is no point of the recording, by fields as pt11.x_m or pt11_X; accepted: ");
  expect(kWings + points("pt2") + kMarkers, "wings.points.right_tip: \"pt2\" is left_tip, too; accepted: six points");
  expect(kWings + points("pt5", "pt4", "pt1") + kMarkers,
         "wings.points.left_root: \"pt4\" is on the right of \"pt1\" in ");
  expect(kWings + kPoints + "columns = { left_stroke_rad = \"pt1_X\" }\n",
         "wings.columns: is given with points; accepted: one of the two");
  expect(kWings +
             "columns = { left_stroke_rad = \"pt1_X\", left_rotation_rad = \"pt1_X\", right_stroke_rad = \"pt1_X\", "
             "right_rotation_rad = \"pt1_X\" }\n",
         "wings.unit_m: is given without points; accepted: points");
  expect(kWings + kPoints + kMarkers + "attitude = [1.0, 0.0, 0.0, 0.0]\n",
         "wings.attitude: is given with markers, which show it; accepted: one of the two");
  expect(kWings + kPoints + "attitude = [1.0, 1.0, 0.0, 0.0]\n",
         "wings.attitude: has another length than 1; accepted: a quaternion w, x, y, z of length 1");
  expect("[wings]\nchannel = \"flightxyzpts\"\ntime = \"stamp\"\nframe_rate_hz = 10.0\nnoise_rad = 0.1\n" + kPoints,
         "wings.frame_rate_hz: is given with time = \"stamp\"; accepted: time = \"frame\"");
  expect("[wings]\nchannel = \"flightxyzpts\"\ntime = \"frame\"\nnoise_rad = 0.1\n" + kPoints,
         "wings.frame_rate_hz: is missing");
  Film pictures;
  pictures.add("flightxypts.tsv", sparse(true));
  EXPECT_NE(pictures.refusal(kRig + kWings + kPoints + kMarkers)
                .find("flightxypts.tsv: holds points of pictures; accepted: points in space, as in xyzpts.tsv"),
            std::string::npos);
}

}  // namespace
}  // namespace flappy::flightlog::wing_film_test
