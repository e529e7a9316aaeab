// Effects that MuJoCo's fluid model lacks: room, wind, the wings' own wake. Most are a factor on each ellipsoid's fluid
// force.
#pragma once

#include "lab/blind/c/c_drive.hpp"
#include "lab/blind/c/mechanism.hpp"

namespace flappy::blind::c {

/// Surfaces of the room, declared in every log: ground z = 0, ceiling z = 2, one wall y = 1.
struct Room {
  static constexpr double kGround_m = 0, kCeiling_m = 2, kWall_m = 1;
};

class Air {
 public:
  Air(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight);
  /// Sets force factors, wind and twist for the next step. Returns the wrench on the torso at its origin, in W.
  Wrench act(Mechanism& mechanism, double step_s);

 private:
  /// Change of factor, and the wing's share of the pull of the wall.
  std::pair<double, double> room(const Mechanism& mechanism, const Motion& torso, std::size_t side) const;
  double wing_factor(std::size_t side) const;
  void blow(Mechanism& mechanism, double step_s);

  const RobotParameters* parameters_;
  double ground_, ceiling_, wall_, wake_, fling_, flexibility_, wind_, tether_, downwash_, snap_;
  Random random_;
  Eigen::Vector3d mean_wind_ = Eigen::Vector3d::Zero(), anchor_ = Eigen::Vector3d::Zero(), rising_, falling_;
  double pulse_;  ///< part of the rising pulse that has passed, from 0 to 0.5
  std::array<double, 2> travelled_m_{}, met_rad_{}, opened_rad_{}, direction_{}, twist_rad_{}, camber_{}, camber_to_{};
  double stroke_rate_squared_ = 0;
  bool any_factor_;
};

/// Where a wing's axis is at a radius, in W.
Eigen::Vector3d reach_W(const RobotParameters& parameters, const Motion& torso, std::size_t side, double stroke_rad,
                        double radius_m);

}  // namespace flappy::blind::c
