// Compares motion capture with the IMU's dead reckoning, without a vehicle model. Reckoning drifts, but over a few
// beats the curvature of its path and its angular rate must agree with motion capture. Differences show errors of
// sensors. span: duration of kSpan beats.
//   path    second difference over kSpan beats of (measured - reckoned) origin / span^2, in W. Shows a tilted vertical,
//           a marker off the origin, late poses, a misaligned or biased accelerometer
//   rotate  central difference over 2 kSpan beats of the rotation vector from reckoned to measured attitude in W
//           / (2 span), rotated to B, less its mean over the flight. Shows a changing gyro bias, late poses
#pragma once

#include <vector>

#include "gap/replay/beat_rows.hpp"
#include "gap/replay/recording.hpp"

namespace flappy::gap {

struct StreamRow {
  Eigen::Vector3d path_m_s2 = Eigen::Vector3d::Zero();     ///< in W
  Eigen::Vector3d rotate_rad_s = Eigen::Vector3d::Zero();  ///< in B
  bool valid = false;  ///< false: motion capture lacks one of the kSpan beats to either side; the rows are 0
};

/// [beat] Rows of path and rotate.
std::vector<StreamRow> stream_rows(const Recording& recording);
/// [beat] Rows that the declared noise of IMU and motion capture would give; `mocap_alone`: of motion capture alone.
std::vector<StreamRow> stream_noise(const Recording& recording, std::uint64_t seed, bool mocap_alone);

}  // namespace flappy::gap
