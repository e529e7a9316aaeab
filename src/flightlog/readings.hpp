// What motion capture and IMU of a log read, as vectors: the one place that takes a log's columns for motion.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

/// A pose of motion capture at the instant at which it was so: t_s of the log less the declared latency.
struct PoseReading {
  double t_s;
  Eigen::Vector3d position_m;
  std::array<double, 4> quaternion;  ///< as logged, declared w, x, y, z
  std::size_t row;                   ///< of mocap.csv, from 0
  Eigen::Quaterniond attitude() const { return {quaternion[0], quaternion[1], quaternion[2], quaternion[3]}; }
};
/// Of the log, without lost ones, which repeat the pose before where noise is declared, and without those whose markers were taken for
/// others, which leap away and back within a few frames.
std::vector<PoseReading> pose_readings(const FlightLog& log);

/// Of each pose of mocap.csv, the attitude that attitude.csv has at its instant; nothing where it has none, or a gap.
std::vector<std::optional<Eigen::Quaterniond>> second_attitudes(const FlightLog& log);

/// Of each pose of mocap.csv, whether its markers were taken for others: it leaps away and back within a few frames, or is turned
/// against attitude.csv by far more than those around it.
std::vector<char> swapped_poses(const FlightLog& log);

/// The log with samples of motion capture, IMU and power at the instants of the regular clocks that took them, where their times are
/// those of arrival: a line through them, gaps counted. Left as they are where no such clock is found.
FlightLog on_its_clocks(FlightLog log);

/// A sample of the IMU, in B; its rate is 0 where there is no gyro.
struct ImuReading {
  Eigen::Vector3d rate_rad_s, force_m_s2;
};
inline ImuReading imu_reading(const ImuStream& s, std::size_t i) {
  const Eigen::Vector3d force(s.accel_x_m_s2[i], s.accel_y_m_s2[i], s.accel_z_m_s2[i]);
  if (s.gyro_x_rad_s.empty()) return {Eigen::Vector3d::Zero(), force};
  return {{s.gyro_x_rad_s[i], s.gyro_y_rad_s[i], s.gyro_z_rad_s[i]}, force};
}

/// Index of the last of increasing `times` not after a time; 0 before the first.
std::size_t last_not_after(const std::vector<double>& times, double t_s);

}  // namespace flappy::flightlog
