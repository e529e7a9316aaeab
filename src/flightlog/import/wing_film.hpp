// The angles of the wings by digitised points: of each wing the root and the tip, two points of its axis of rotation, and
// a trailing point anywhere behind that axis.
//
// In B, u points from root to tip, and c from the trailing point at right angles to the axis. With s = +1 left, -1 right,
// the stroke plane Phi and E = R_y(-Phi) R_z(s psi) R_x(s phi) (model/jointed.hpp), u = s E e_y and c is along E R_y(theta) e_z:
//   u' = R_y(Phi) u       psi = atan2(-u'_x, s u'_y)       phi = asin(u'_z)
//   c' = E^T c            theta = atan2(c'_x, c'_z)
// stroke psi, deviation phi, rotation theta [1, 2]. Only directions count, so the origin of B does not matter, and of a
// pose the attitude alone.
//
// Noise sigma of each coordinate gives, at the length L from root to tip, the distance d of the trailing point from the
// axis, its foot at the share lambda of L, and phi = 0, standard deviations of
//   psi, phi: sqrt(2) sigma / L        theta: sigma sqrt(1 + (1 - lambda)^2 + lambda^2) / d
// and the distance of root and tip scatters by sqrt(2) sigma, so psi by that scatter over L.
//
// Assumes that root and tip stay on the axis: a wing that bends towards its tip shows the angles of its chord from root
// to tip. A digitised wing is implausible, and none is guessed in its place, where a distance of two of its points differs
// from its median by more than a share, or where the left root is on the right of the right one.
//
// [1] Hedrick, Software techniques for two- and three-dimensional kinematic measurements of biological and biomimetic
//     systems, Bioinspir. Biomim. 3, 034001 (2008): DLTdv.
// [2] Fei et al., Flappy Hummingbird, ICRA 2019, arXiv 1902.09628: angles of the wing.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace flappy::flightlog {

struct WingPoints {
  Eigen::Vector3d root, tip, trailing;
};

struct WingAngles {
  double stroke_rad, rotation_rad, deviation_rad;
};

/// `side`: +1 left, -1 right; `p`: m, in axes of B.
WingAngles wing_angles(int side, const WingPoints& p, double stroke_plane_rad);

struct FilmedFrame {
  std::array<WingPoints, 2> wings;             ///< left, right; m; NaN for a point that was not seen
  std::optional<Eigen::Quaterniond> attitude;  ///< B to the axes of the points; none: not known
};

struct FilmedWings {
  std::vector<std::array<WingAngles, 2>> angles;  ///< [frame]; NaN in a frame with a fault
  std::vector<std::string> faults;                ///< [frame]; empty: none
  std::size_t swapped = 0, whole = 0;             ///< frames with left and right swapped, of those with both wings in B
  double stroke_noise_rad = 0;                    ///< of a sample, by the scatter of the distance of root and tip
};

/// Angles of each frame that is plausible. `names`: of the points, as kWingPoints.
FilmedWings filmed_wings(const std::vector<FilmedFrame>& frames, const std::vector<std::string>& names,
                         double stroke_plane_rad, double length_tolerance);

}  // namespace flappy::flightlog
