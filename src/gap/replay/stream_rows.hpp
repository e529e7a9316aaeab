// Motion capture compared with the IMU, without a vehicle model. Dead reckoning of the IMU gives a path and an attitude that drift; over a few
// beats, their curvature and rate must agree with those of motion capture. The differences show errors of sensors:
//   path  second difference over kSpan beats of (measured - reckoned) origin / span^2, in W: a tilted vertical, a marker that is not
//         at the origin, late poses, a misaligned or biased accelerometer
//   turn  central difference over 2 kSpan beats of the rotation from the reckoned to the measured attitude / (2 span), taken in W, expressed in B,
//         less its mean over the flight: a gyro whose bias changes, late poses
#pragma once

#include <vector>

#include "gap/replay/beat_rows.hpp"
#include "gap/replay/recording.hpp"

namespace flappy::gap {

struct StreamRow {
  Eigen::Vector3d path_m_s2 = Eigen::Vector3d::Zero(), turn_rad_s = Eigen::Vector3d::Zero();
  bool valid = false;
};

/// [beat].
std::vector<StreamRow> stream_rows(const Recording& recording);
/// Rows that the declared noise alone would give, [beat]: noise of the IMU and motion capture, or of motion capture alone.
std::vector<StreamRow> stream_noise(const Recording& recording, std::uint64_t seed, bool mocap_alone);

}  // namespace flappy::gap
