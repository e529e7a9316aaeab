// Samples of motion capture and IMU as vectors, for all code that needs motion.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

/// A pose of motion capture. t_s is the measured instant: t_s of the log less the declared latency.
struct PoseReading {
  double t_s;
  Eigen::Vector3d position_m;
  std::array<double, 4> quaternion;  ///< as logged, in the declared order w, x, y, z
  std::size_t row;                   ///< in mocap.csv, from 0
  Eigen::Quaterniond attitude() const { return {quaternion[0], quaternion[1], quaternion[2], quaternion[3]}; }
};
/// The poses without lost ones, which repeat the pose before despite declared noise, and without those of swapped
/// markers, which leap away and back within a few frames.
std::vector<PoseReading> pose_readings(const FlightLog& log);

/// For each row of mocap.csv, the attitude from attitude.csv at that instant; nothing outside its time and in its gaps.
std::vector<std::optional<Eigen::Quaterniond>> second_attitudes(const FlightLog& log);

/// For each row of mocap.csv, whether its markers were swapped: the pose leaps away and back, or is turned against
/// attitude.csv far more than the poses around it.
std::vector<char> swapped_poses(const FlightLog& log);

/// Replaces the jittering times of arrival of mocap, IMU and power by the nearest times of a regular clock (first instant,
/// period, gaps counted); the mean latency stays in them. A stream that fits no regular clock keeps its times.
FlightLog on_its_clocks(FlightLog log);

/// A sample of the IMU, in B; the rate is 0 where there is no gyro.
struct ImuReading {
  Eigen::Vector3d rate_rad_s, force_m_s2;
};
inline ImuReading imu_reading(const ImuStream& s, std::size_t i) {
  const Eigen::Vector3d force(s.accel_x_m_s2[i], s.accel_y_m_s2[i], s.accel_z_m_s2[i]);
  if (s.gyro_x_rad_s.empty()) return {Eigen::Vector3d::Zero(), force};
  return {{s.gyro_x_rad_s[i], s.gyro_y_rad_s[i], s.gyro_z_rad_s[i]}, force};
}

/// Index of the last element of `times`, which increase, that is not after t_s; 0 if all are after it.
std::size_t last_not_after(const std::vector<double>& times, double t_s);

}  // namespace flappy::flightlog
