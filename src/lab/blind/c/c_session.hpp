// Another day's flights of the same robot: other random numbers, and small, harmless changes.
#pragma once

#include <array>

#include "lab/blind/c/c_random.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind::c {

inline constexpr std::size_t kPilotGains = 16;

template <std::size_t n>
constexpr std::array<double, n> filled(double value) {
  std::array<double, n> all{};
  all.fill(value);
  return all;
}

/// What has changed since session 0, by default nothing. Factors where no unit stands; pairs are left and right.
struct SessionChange {
  double air = 1;                                       ///< on the density
  double supply = 1;                                    ///< on the voltage of the full battery
  std::array<double, 2> winding = {1, 1};               ///< on the resistance
  std::array<double, 2> friction = {1, 1};              ///< of the motor and the stroke hinge
  std::array<double, 2> damping = {1, 1};               ///< of the motor and the stroke hinge
  std::array<double, 2> rest_rad{};                     ///< added to the springs' rest angles
  double tape_kg = 0;                                   ///< added to the torso, at the battery
  Eigen::Vector3d battery_m = Eigen::Vector3d::Zero();  ///< shift of the battery, B
  Eigen::Vector3d imu_turn_rad = Eigen::Vector3d::Zero(), gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d markers_m = Eigen::Vector3d::Zero(), markers_turn_rad = Eigen::Vector3d::Zero();  ///< B
  double imu_late_s = 0, mocap_late_s = 0;                         ///< added to the latencies
  std::array<double, kPilotGains> gains = filled<kPilotGains>(1);  ///< of the pilot, in the order of Pilot::Gains
};

/// Drawn once for all flights of a session. No bound is as large as an effect of magnitude 0.2.
SessionChange session_change(const Assignment& a);

/// Number of a flight's random streams of noise. In session 0 it is that of the flight.
std::uint64_t stream_of(const Assignment& a, std::size_t flight);
/// The same of what is flown: Assignment::programme_of.
std::uint64_t programme_stream_of(const Assignment& a, std::size_t flight);

}  // namespace flappy::blind::c
