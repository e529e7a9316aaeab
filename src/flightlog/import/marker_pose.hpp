// The pose of a rigid body by its markers.
//
// The rotation and translation that bring the markers' places in B nearest to where they were seen, by least squares:
// Horn, Closed-form solution of absolute orientation using unit quaternions, J. Opt. Soc. Am. A 4, 629 (1987). It needs
// three markers that are not in one line. Assumption: the markers do not move in B.
//
// A marker that is farther from its place than a tolerance is a wrong one. Then two names may have been swapped, also that of
// a marker which was not seen; or one marker is left out, if three others agree. What agrees in two ways is decided by the
// frame before; a frame in which nothing agrees has no pose.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace flappy::flightlog {

struct MarkerPose {
  Eigen::Vector3d position;     ///< m, of B's origin
  Eigen::Quaterniond attitude;  ///< B to the world of the markers
  double residual_m = 0;        ///< root mean square of the distances of the markers used
  double farthest_m = 0;        ///< the largest of them
};

using Places = std::vector<Eigen::Vector3d>;

/// The least-squares pose; `seen` are the places of the same markers, NaN for one that was not seen. Nothing for less than
/// three seen ones, and for ones in one line.
std::optional<MarkerPose> pose_by_markers(const Places& in_body, const Places& seen);

class MarkerTracker {
 public:
  MarkerTracker(Places in_body, double tolerance_m);

  /// The pose of the next frame, if any agrees within the tolerance.
  std::optional<MarkerPose> next(const Places& seen);

  using Pair = std::pair<std::size_t, std::size_t>;
  /// Pairs of markers that can be swapped without a trace in one frame.
  const std::vector<Pair>& alike() const { return alike_; }
  /// How many frames had which two names swapped, which marker left out, and which marker not seen, so far.
  const std::vector<std::size_t>& swapped() const { return swapped_; }
  const std::vector<std::size_t>& left_out() const { return left_out_; }
  const std::vector<std::size_t>& lost() const { return lost_; }
  /// The pair of markers of an element of swapped().
  Pair pair(std::size_t index) const { return pairs_[index]; }

 private:
  Places in_body_;
  double tolerance_m_;
  std::vector<Pair> pairs_, alike_;
  std::vector<std::size_t> swapped_, left_out_, lost_;
  std::optional<Eigen::Quaterniond> before_;  ///< attitude of the frame before
};

}  // namespace flappy::flightlog
