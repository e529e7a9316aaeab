// Motion capture against the IMU's dead reckoning, without a vehicle model. Reckoning drifts, but over a few beats its
// curvature and rate must agree. Differences show errors of sensors:
//   path    second difference over kSpan beats of (measured - reckoned) origin / span^2, in W: tilted vertical, marker
//           off the origin, late poses, misaligned or biased accelerometer
//   rotate  central difference over 2 kSpan beats of the rotation from reckoned to measured attitude / (2 span), taken
//           in W, in B, less its mean over the flight: changing gyro bias, late poses
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

/// [beat].
std::vector<StreamRow> stream_rows(const Recording& recording);
/// [beat] Rows that the declared noise would give: of IMU and motion capture, or of motion capture alone.
std::vector<StreamRow> stream_noise(const Recording& recording, std::uint64_t seed, bool mocap_alone);

}  // namespace flappy::gap
