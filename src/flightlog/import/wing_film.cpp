#include "flightlog/import/wing_film.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Below this share of the length, the trailing point is too near the axis to show the rotation: noise of 1 % of the length
/// would turn it by half a radian.
constexpr double kNearAxis = 0.02;
const char* const kSideNames[] = {"left", "right"};

std::array<Eigen::Vector3d, 3> points_of(const WingPoints& p) { return {p.root, p.tip, p.trailing}; }

/// Distances from root to tip, tip to trailing point, trailing point to root, m.
std::array<double, 3> lengths_of(const WingPoints& p) {
  return {(p.tip - p.root).norm(), (p.trailing - p.tip).norm(), (p.root - p.trailing).norm()};
}

/// The vector from the trailing point to the axis, at right angles to it.
Eigen::Vector3d chord_of(const WingPoints& p) {
  const Eigen::Vector3d along = (p.tip - p.root).normalized(), behind = p.trailing - p.root;
  return along * along.dot(behind) - behind;
}

using Lengths = std::array<std::array<double, 3>, 2>;

/// Median lengths of each wing; NaN where it is never seen whole.
Lengths usual_lengths(const std::vector<FilmedFrame>& frames) {
  Lengths usual;
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<double> lengths;
      for (const FilmedFrame& frame : frames)
        if (const double length = lengths_of(frame.wings[side])[k]; std::isfinite(length)) lengths.push_back(length);
      usual[side][k] = lengths.empty() ? std::numeric_limits<double>::quiet_NaN() : io::median(lengths);
    }
  return usual;
}

/// Why the wings of a frame cannot be used; empty where they can.
std::string fault_of_wings(const FilmedFrame& frame, const Lengths& usual, const std::vector<std::string>& names,
                           double tolerance) {
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t k = 0; k < 3; ++k)
      if (!points_of(frame.wings[side])[k].allFinite()) return "without " + names[3 * side + k];
  if (!frame.attitude) return "without attitude of the body";
  const Eigen::Vector3d across = frame.attitude->conjugate() * (frame.wings[0].root - frame.wings[1].root);
  if (across.y() <= 0) return "with left and right wing swapped";
  for (std::size_t side = 0; side < 2; ++side) {
    const std::array<double, 3> lengths = lengths_of(frame.wings[side]);
    for (std::size_t k = 0; k < 3; ++k)
      if (!(std::abs(lengths[k] - usual[side][k]) <= tolerance * usual[side][k]))
        return "with " + std::string(kSideNames[side]) + " points at distances that are not the wing's";
    if (!(chord_of(frame.wings[side]).norm() > kNearAxis * lengths[0]))
      return "with " + names[3 * side + 2] + " in line with root and tip";
  }
  return "";
}

}  // namespace

WingAngles wing_angles(int side, const WingPoints& p, double stroke_plane_rad) {
  using Turn = Eigen::AngleAxisd;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const Turn plane(-stroke_plane_rad, y);
  const Eigen::Vector3d u = plane.inverse() * (p.tip - p.root).normalized();
  WingAngles angles{std::atan2(-u.x(), side * u.y()), 0, std::asin(std::clamp(u.z(), -1.0, 1.0))};
  const Eigen::Matrix3d edge =
      (plane * Turn(side * angles.stroke_rad, z) * Turn(side * angles.deviation_rad, x)).toRotationMatrix();
  const Eigen::Vector3d c = edge.transpose() * chord_of(p);
  angles.rotation_rad = std::atan2(c.x(), c.z());
  return angles;
}

FilmedWings filmed_wings(const std::vector<FilmedFrame>& frames, const std::vector<std::string>& names,
                         double stroke_plane_rad, double length_tolerance) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr WingAngles kNoAngles{kNone, kNone, kNone};
  const Lengths usual = usual_lengths(frames);
  FilmedWings out;
  double squares = 0, count = 0;
  for (const FilmedFrame& frame : frames) {
    std::string fault = fault_of_wings(frame, usual, names, length_tolerance);
    const bool swapped = fault.ends_with("swapped");
    out.swapped += swapped;
    out.whole += swapped || !fault.starts_with("without");
    out.angles.push_back({kNoAngles, kNoAngles});
    for (std::size_t side = 0; side < 2 && fault.empty(); ++side) {
      WingPoints in_body = frame.wings[side];
      for (Eigen::Vector3d* point : {&in_body.root, &in_body.tip, &in_body.trailing})
        *point = frame.attitude->conjugate() * *point;
      out.angles.back()[side] = wing_angles(side == 0 ? 1 : -1, in_body, stroke_plane_rad);
      squares += std::pow(lengths_of(in_body)[0] / usual[side][0] - 1, 2), ++count;
    }
    out.faults.push_back(std::move(fault));
  }
  if (count > 0) out.stroke_noise_rad = std::sqrt(squares / count);
  return out;
}

}  // namespace flappy::flightlog
