// What motion capture says of a flight against the IMU alone, with no vehicle between them. By dead reckoning the IMU gives
// a path and an attitude that drift; over a few beats they must bend and turn as the seen ones do:
//   path  second difference over kSpan beats of (seen - reckoned) origin / span^2, in W: wrong verticals, a marker that is not
//         at the origin, late poses, an accelerometer turned or biased
//   turn  central difference of the turn from reckoned to seen attitude / (2 span), taken in W, seen in B, less its mean over the flight: a
//         gyro whose bias changes, late poses
#pragma once

#include <vector>

#include "gap/replay/beat_rows.hpp"
#include "gap/replay/recording.hpp"

namespace flappy::gap {

/// Of one beat.
struct StreamRow {
  Eigen::Vector3d path_m_s2 = Eigen::Vector3d::Zero(), turn_rad_s = Eigen::Vector3d::Zero();
  bool valid = false;
};

/// One for each beat.
std::vector<StreamRow> stream_rows(const Recording& recording);
/// The same of noise as the header declares it and nothing else: of both streams, or of motion capture alone.
std::vector<StreamRow> stream_noise(const Recording& recording, std::uint64_t seed, bool mocap_alone);

}  // namespace flappy::gap
