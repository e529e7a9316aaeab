#include "flightlog/import/marker_pose.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace flappy::flightlog {
namespace {

/// Markers are in one line if their second principal extent is less than this share of the first: noise of 0.1 mm on markers
/// 10 mm apart would turn the body about the line by more than it can be told.
constexpr double kInLine = 0.02;
const Eigen::Vector3d kNotSeen = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

bool are_in_line(const Eigen::Matrix3d& spread) {
  const Eigen::Vector3d extents =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues();
  return !(extents[1] > kInLine * kInLine * extents[2]);
}

/// Largest angle of two poses that count as one, rad: candidates differ by marker noise, or by a symmetry of the markers.
constexpr double kSame_rad = 0.2;

}  // namespace

std::optional<MarkerPose> pose_by_markers(const Places& in_body, const Places& seen) {
  Eigen::Vector3d body_mean = Eigen::Vector3d::Zero(), seen_mean = body_mean;
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i].allFinite()) used.push_back(i), body_mean += in_body[i], seen_mean += seen[i];
  if (used.size() < 3) return std::nullopt;
  const double count = static_cast<double>(used.size());
  body_mean /= count, seen_mean /= count;
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero(), spread = s;  // Horn's S: sums of products of body and seen
  for (const std::size_t i : used) {
    s += (in_body[i] - body_mean) * (seen[i] - seen_mean).transpose();
    spread += (in_body[i] - body_mean) * (in_body[i] - body_mean).transpose();
  }
  if (are_in_line(spread)) return std::nullopt;
  // The quaternion is the eigenvector of the largest eigenvalue of Horn's N.
  const Eigen::Vector3d skew(s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0));
  Eigen::Matrix4d n;
  n(0, 0) = s.trace();
  n.block<1, 3>(0, 1) = skew.transpose();
  n.block<3, 1>(1, 0) = skew;
  n.block<3, 3>(1, 1) = s + s.transpose() - s.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector4d q = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(n).eigenvectors().col(3);
  MarkerPose pose{Eigen::Vector3d::Zero(), Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
  pose.position = seen_mean - pose.attitude * body_mean;
  double squares = 0;
  for (const std::size_t i : used) {
    const double distance = (pose.attitude * in_body[i] + pose.position - seen[i]).norm();
    squares += distance * distance;
    pose.farthest_m = std::max(pose.farthest_m, distance);
  }
  pose.residual_m = std::sqrt(squares / count);
  return pose;
}

MarkerTracker::MarkerTracker(Places in_body, double tolerance_m)
    : in_body_(std::move(in_body)), tolerance_m_(tolerance_m), left_out_(in_body_.size()), lost_(in_body_.size()) {
  for (std::size_t i = 0; i < in_body_.size(); ++i)
    for (std::size_t j = i + 1; j < in_body_.size(); ++j) {
      pairs_.emplace_back(i, j);
      Places swapped = in_body_;
      std::swap(swapped[i], swapped[j]);
      const auto pose = pose_by_markers(in_body_, swapped);
      if (pose && pose->farthest_m <= tolerance_m_) alike_.emplace_back(i, j);
    }
  swapped_.resize(pairs_.size());
}

std::optional<MarkerPose> MarkerTracker::next(const Places& seen) {
  for (std::size_t i = 0; i < seen.size(); ++i) lost_[i] += !seen[i].allFinite();
  struct Candidate {
    MarkerPose pose;
    std::size_t* count;  ///< what it counts as; null for the names as they are
  };
  std::vector<Candidate> found;
  const auto consider = [&](const Places& places, std::size_t* count) {
    const auto pose = pose_by_markers(in_body_, places);
    if (pose && pose->farthest_m <= tolerance_m_) found.push_back({*pose, count});
  };
  consider(seen, nullptr);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const auto [i, j] = pairs_[k];
    if (!seen[i].allFinite() && !seen[j].allFinite()) continue;
    // names that agree are swapped only where that leaves no trace, too
    if (!found.empty() && found.front().count == nullptr && std::ranges::find(alike_, pairs_[k]) == alike_.end())
      continue;
    Places places = seen;
    std::swap(places[i], places[j]);
    consider(places, &swapped_[k]);
  }
  if (found.empty())
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!seen[i].allFinite()) continue;
      Places places = seen;
      places[i] = kNotSeen;
      consider(places, &left_out_[i]);
    }
  if (found.empty()) return std::nullopt;
  const auto turned = [&](const Candidate& c) { return before_ ? before_->angularDistance(c.pose.attitude) : 0; };
  const auto best = std::ranges::min_element(found, {}, turned);
  // two different poses that agree, and no frame before: none can be told right, but for the names as they are
  const auto other = [&](const Candidate& c) {
    return c.pose.attitude.angularDistance(best->pose.attitude) > kSame_rad;
  };
  if (!before_ && best->count != nullptr && std::ranges::any_of(found, other)) return std::nullopt;
  if (best->count != nullptr) ++*best->count;
  before_ = best->pose.attitude;
  return best->pose;
}

}  // namespace flappy::flightlog
