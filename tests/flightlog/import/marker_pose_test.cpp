#include "flightlog/import/marker_pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "flightlog/rotation.hpp"

namespace flappy::flightlog::marker_pose_test {
namespace {

const Places kPlaces = {{0.05, 0, 0.01}, {-0.04, 0.03, 0}, {-0.05, -0.02, 0.005}, {0, 0.01, 0.04}};
const Eigen::Vector3d kGone = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

Eigen::Quaterniond attitude(int i) { return exponential({0.3, 0.02 * i, 1 + 0.05 * i}); }
Eigen::Vector3d position(int i) { return {0.1 * i, -1, 0.8}; }

Places seen_at(int i, const Places& places = kPlaces) {
  Places seen;
  for (const Eigen::Vector3d& place : places) seen.push_back(attitude(i) * place + position(i));
  return seen;
}

void expect_pose(const std::optional<MarkerPose>& pose, int i, double tolerance = 1e-12) {
  ASSERT_TRUE(pose) << i;
  EXPECT_LT((pose->position - position(i)).norm(), tolerance) << i;
  EXPECT_LT(pose->attitude.angularDistance(attitude(i)), 1e-7) << i;  // the square root of rounding
}

TEST(MarkerPose, IsTheLeastSquaresPose) {
  for (int i = 0; i < 100; i += 7) {
    expect_pose(pose_by_markers(kPlaces, seen_at(i)), i);
    const Places flat = {{0.1, 0, 0}, {0, 0.1, 0}, {-0.1, -0.05, 0}};  // three are always flat
    expect_pose(pose_by_markers(flat, seen_at(i, flat)), i);
  }
  // A square that is seen larger by e: B stays, and each corner is e sqrt(2) away.
  const Places square = {{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}};
  Places larger = square;
  for (Eigen::Vector3d& corner : larger) corner *= 1.01;
  const auto pose = pose_by_markers(square, larger);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose->position.norm(), 1e-12);
  EXPECT_NEAR(pose->residual_m, 0.01 * std::sqrt(2), 1e-12);
  EXPECT_NEAR(pose->farthest_m, 0.01 * std::sqrt(2), 1e-12);
}

TEST(MarkerPose, NeedsThreeMarkersThatAreNotInOneLine) {
  Places seen = seen_at(0);
  seen[1] = kGone;
  EXPECT_TRUE(pose_by_markers(kPlaces, seen));
  seen[3] = kGone;
  EXPECT_FALSE(pose_by_markers(kPlaces, seen));
  const Places line = {{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}, {0.3, 0, 0}};
  EXPECT_FALSE(pose_by_markers(line, line));
}

TEST(MarkerTracker, PutsSwappedNamesRight) {
  MarkerTracker tracker(kPlaces, 0.002);
  EXPECT_TRUE(tracker.alike().empty());
  for (int i = 0; i < 40; ++i) {
    Places seen = seen_at(i);
    if (i % 4 == 1) std::swap(seen[0], seen[2]);
    if (i % 4 == 2) seen[1] = seen[3], seen[3] = kGone;  // 3 is seen as 1, which is lost
    expect_pose(tracker.next(seen), i);
  }
  std::size_t pairs = 0;
  for (std::size_t k = 0; k < tracker.swapped().size(); ++k) {
    const bool expected = tracker.pair(k) == MarkerTracker::Pair(0, 2) || tracker.pair(k) == MarkerTracker::Pair(1, 3);
    EXPECT_EQ(tracker.swapped()[k], expected ? 10u : 0u);
    pairs += expected;
  }
  EXPECT_EQ(pairs, 2u);
  EXPECT_EQ(tracker.lost()[3], 10u);
}

TEST(MarkerTracker, LeavesOutAMarkerThatIsElsewhere) {
  MarkerTracker tracker(kPlaces, 0.002);
  for (int i = 0; i < 40; ++i) {
    Places seen = seen_at(i);
    if (i % 2 == 1) seen[i % 4] += Eigen::Vector3d(0, 0, 0.02);
    expect_pose(tracker.next(seen), i);
  }
  EXPECT_EQ(tracker.left_out(), (std::vector<std::size_t>{0, 10, 0, 10}));
  // two that are elsewhere leave no pose, instead of a smeared one
  Places seen = seen_at(40);
  seen[0] += Eigen::Vector3d(0, 0, 0.02), seen[1] += Eigen::Vector3d(0, 0.03, 0);
  EXPECT_FALSE(tracker.next(seen));
}

/// Three of two equal sides: names that are swapped agree exactly, with the body turned over.
TEST(MarkerTracker, TellsSymmetricMarkersByTheFrameBefore) {
  const Places equal = {{0.06, 0, 0}, {-0.02, 0.04, 0}, {-0.02, -0.04, 0}};
  MarkerTracker tracker(equal, 0.002);
  EXPECT_EQ(tracker.alike(), (std::vector<MarkerTracker::Pair>{{1, 2}}));
  for (int i = 0; i < 20; ++i) {
    Places seen = seen_at(i, equal);
    if (i % 3 == 2) std::swap(seen[1], seen[2]);
    expect_pose(tracker.next(seen), i);
  }
}

}  // namespace
}  // namespace flappy::flightlog::marker_pose_test
