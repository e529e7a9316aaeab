// The motion of a recorded flight as means over beats, from motion capture alone, or with a gyro: low-passed far below the beat, without
// delay.
//
//   x' = F x      F: Butterworth's filter of order 4, forward and backward, so that |F|^2 = 1 / (1 + (f / bandwidth)^8) and no phase [1]
//   v = R'^T F dp/dt,  f = R'^T (F d2p/dt2 + g),  w: of R', or F of the gyro's rate,  a = dw/dt      R': F of the quaternions, made whole
// Central differences on a regular grid; what inputs do goes through the same filter, so that both sides of an equation have seen it.
// [1] Gustafsson, Determining the initial states in forward-backward filtering, IEEE Trans. Signal Processing 44(4), 1996: two passes. Ends are
//     continued as odd reflections, and not used.
#pragma once

#include <Eigen/Dense>
#include <filesystem>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

/// Forward and backward. `per_sample`: the bandwidth over the rate, below 0.5.
std::vector<double> low_pass(const std::vector<double>& x, double per_sample);

struct MeanMotion {
  double begin_s = 0, step_s = 0;
  std::vector<Eigen::Vector3d> position_m;      ///< of the torso's origin in W, as all below at every step of the grid
  std::vector<Eigen::Matrix3d> attitude;        ///< R_WB
  std::vector<Eigen::Vector3d> velocity_B_m_s;  ///< in B
  std::vector<Eigen::Vector3d> rate_rad_s;      ///< in B
  std::vector<Eigen::Vector3d> turning_rad_s2;  ///< its derivative
  std::vector<Eigen::Vector3d> force_m_s2;      ///< specific force, in B
  std::vector<char> seen;                       ///< whether motion capture was there, long before and after
  std::size_t size() const { return seen.size(); }
  double t_s(std::size_t i) const { return begin_s + step_s * static_cast<double>(i); }
};

/// io::InputError naming `folder` where fewer poses than a filter needs are left.
MeanMotion mean_motion(const FlightLog& log, double bandwidth_Hz, const std::filesystem::path& folder);

}  // namespace flappy::flightlog
