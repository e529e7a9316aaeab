// The beat-averaged motion of a flight, from mocap and the gyro, if any: low-passed far below the beat, without delay.
//
//   x' = F x    F = |H|^2, H of order 4, Butterworth: |H|^2 = 1 / (1 + (f / bandwidth)^8), forward and backward [1]
//   R' = F applied to the quaternions, normalised again
//   velocity v = R'^T F dp/dt,  specific force f = R'^T (F d2p/dt2 + g),  rate w = F gyro, or from R',  a = dw/dt
// The gyro is late by its latency and by its filter, which delays motion far below its bandwidth by
// 1 / (2 pi bandwidth_hz). Derivatives are central differences on a regular grid. Inputs compared with this motion must be filtered with F, too.
// [1] Gustafsson, IEEE Trans. Signal Processing 44(4), 1996, on initial states. Here odd reflections continue the
//     signal, and samples near the ends are unseen.
#pragma once

#include <Eigen/Dense>
#include <filesystem>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

/// F of the file head, applied to `x`. `per_sample`: bandwidth divided by sample rate, below 0.5.
std::vector<double> low_pass(const std::vector<double>& x, double per_sample);

struct BeatAveragedMotion {
  double begin_s = 0, step_s = 0;
  std::vector<Eigen::Vector3d> position_m;      ///< torso origin in W; one element per step of the grid, as below
  std::vector<Eigen::Matrix3d> attitude;        ///< R_WB
  std::vector<Eigen::Vector3d> velocity_B_m_s;  ///< in B
  std::vector<Eigen::Vector3d> rate_rad_s;      ///< in B
  std::vector<Eigen::Vector3d> turning_rad_s2;  ///< angular acceleration, in B
  std::vector<Eigen::Vector3d> force_m_s2;      ///< specific force, in B
  std::vector<char> seen;                       ///< whether no long gap and no end of the flight is near
  std::size_t size() const { return seen.size(); }
  double t_s(std::size_t i) const { return begin_s + step_s * static_cast<double>(i); }
};

/// A flight too short, or too little of it seen, to be compared.
struct TooLittleSeen : io::InputError {
  using io::InputError::InputError;
};

/// io::InputError, naming `folder`, for mocap slower than four times the bandwidth; TooLittleSeen for too short a flight.
BeatAveragedMotion beat_averaged_motion(const FlightLog& log, double bandwidth_Hz, const std::filesystem::path& folder);

}  // namespace flappy::flightlog
