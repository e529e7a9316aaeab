// Rotation vectors, rad, to quaternions and back, for single values; src/flight/sensors.hpp has the same for lanes.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace flappy::flightlog {

inline Eigen::Quaterniond exponential(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  const double scale = angle < 1e-6 ? 0.5 : std::sin(angle / 2) / angle;
  return {std::cos(angle / 2), scale * turn.x(), scale * turn.y(), scale * turn.z()};
}

/// The rotation vector, rad, of a quaternion of length 1, the shorter way round.
inline Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm(), sign = q.w() < 0 ? -1 : 1;
  if (sine < 1e-12) return 2 * sign * q.vec();
  return q.vec() * (sign * 2 * std::atan2(sine, std::abs(q.w())) / sine);
}

}  // namespace flappy::flightlog
