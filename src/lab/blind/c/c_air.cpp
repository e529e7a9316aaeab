// [1] He et al., In-ground-effect modeling and nonlinear-disturbance observer for multirotor UAV control, ASME J. Dyn.
// Syst. Meas. Control 141(7), 071013 (2019): thrust grows by C_a exp(-C_b z/R), finite at the ground.
// [2] Tu et al., Acting is seeing: navigating tight space using flapping wings, ICRA 2019: surfaces change this robot's
// loads.
// [3] Lehmann, Sane, Dickinson, The aerodynamic effects of wing-wing interaction in flapping insect wings, J. Exp.
// Biol. 208, 3075 (2005): up to 17 % more force over a beat, less with the angle between the wings.
// Laws for ceiling, wall, wake and downwash are our own, as strong as the catalogue's.
#include "lab/blind/c/c_air.hpp"

#include <algorithm>

namespace flappy::blind::c {
namespace {

constexpr double kGustTime_s = 0.4, kMeeting_rad = 20 * M_PI / 180;
constexpr double kHoverRate2 = 2.9e4;  // mean square of the stroke rate of the nominal robot in hover, rad^2/s^2

}  // namespace

Air::Air(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight)
    : parameters_(&parameters),
      ground_(0.15 * magnitudes[Effect::kGround]),
      ceiling_(0.12 * magnitudes[Effect::kCeiling]),
      wall_(magnitudes[Effect::kWall]),
      wake_(0.3 * magnitudes[Effect::kWakeCapture]),
      clap_(0.25 * magnitudes[Effect::kClapAndFling]),
      flexibility_(175 * magnitudes[Effect::kWingFlexibility]),
      wind_(magnitudes[Effect::kWind]),
      tether_(0.2e-3 * magnitudes[Effect::kTether]),
      downwash_(0.03 * magnitudes[Effect::kDownwashOnBody]),
      random_(seed, "gusts", flight),
      any_factor_(ground_ + ceiling_ + wall_ + wake_ + clap_ > 0) {
  Random once(seed, "air");
  const double heading = once.uniform(0, 2 * M_PI);
  mean_wind_ = 0.3 * wind_ * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0);
  anchor_.z() = Room::kGround_m;
  anchor_.y() = once.uniform(-0.3, 0.3);
  anchor_.x() = once.uniform(-0.3, 0.3);
}

double Air::room_factor(const Mechanism& mechanism, std::size_t side, double wall_m) const {
  const double length = parameters_->sides[side].planform.length_m;
  const double z = mechanism.strip_position(side, Mechanism::kStrips - 1).z();
  double factor = 1;
  if (ground_ > 0) factor += ground_ * std::exp(-std::max(0.0, z - Room::kGround_m) / length);
  if (ceiling_ > 0) factor += ceiling_ * std::exp(-std::max(0.0, Room::kCeiling_m - z) / length);
  if (wall_ > 0) factor -= 0.06 * wall_ * std::exp(-std::max(0.0, wall_m) / length);
  return factor;
}

double Air::wing_factor(std::size_t side) const {
  const double chord = parameters_->sides[side].planform.chord_m;
  double factor = 1;
  if (wake_ > 0) factor += wake_ * std::exp(-travelled_m_[side] / chord);  // the wake is one chord long
  if (clap_ > 0)
    factor += clap_ * met_[side] *
              std::exp(-travelled_m_[side] / (3 * chord));  // the fling's circulation decays over three chords
  return factor;
}

void Air::blow(Mechanism& mechanism, double step_s) {
  const double kept = std::exp(-step_s / kGustTime_s), kick = 0.1 * wind_ * std::sqrt(1 - kept * kept);
  gust_ = kept * gust_ + kick * random_.normal3().cwiseProduct(Eigen::Vector3d(1, 1, 0.5));
  mechanism.set_wind(mean_wind_ + gust_);
}

Wrench Air::act(Mechanism& mechanism, double step_s) {
  Wrench wrench;
  const Motion torso = mechanism.motion();
  if (wind_ > 0) blow(mechanism, step_s);
  const std::array<double, 2> wall_m = {Room::kWall_m - mechanism.strip_position(0, Mechanism::kStrips - 1).y(),
                                        Room::kWall_m - mechanism.strip_position(1, Mechanism::kStrips - 1).y()};
  for (std::size_t side = 0; side < 2; ++side) {
    const double rate = mechanism.stroke_rate(side);
    if (rate * direction_[side] <= 0) {
      direction_[side] = rate < 0 ? -1 : 1;
      travelled_m_[side] = 0;
      // closeness of the wings when this one reverses, in front of or behind the body
      const double sum = std::abs(mechanism.stroke(0) + mechanism.stroke(1));
      met_[side] = std::exp(-std::max(0.0, M_PI - sum) / kMeeting_rad);
    }
    travelled_m_[side] += std::abs(rate) * 0.72 * parameters_->sides[side].planform.length_m * step_s;
    if (any_factor_) {
      const double factor = room_factor(mechanism, side, wall_m[side]) * wing_factor(side);
      for (std::size_t i = 0; i < Mechanism::kStrips; ++i) mechanism.scale_air(side, i, factor);
    }
    if (flexibility_ > 0) {  // the outer part yields to the load with a time constant of 1 ms
      const double bound = std::clamp(flexibility_ * mechanism.hinge_torque(side), -0.6, 0.6);
      twist_rad_[side] += (1 - std::exp(-step_s / 1e-3)) * (bound - twist_rad_[side]);
      mechanism.twist(side, twist_rad_[side]);
    }
    if (downwash_ > 0)
      stroke_rate_squared_ += (1 - std::exp(-step_s / 0.015)) / 2 * (rate * rate - stroke_rate_squared_);
  }
  const double weight = parameters_->mass_kg() * Mechanism::kGravity_m_s2;
  if (wall_ > 0) {
    const double away = std::max(0.0, Room::kWall_m - torso.position_W.y() - parameters_->around_m);
    wrench.force_W.y() += 0.02 * wall_ * weight * std::exp(-away / parameters_->sides[0].planform.length_m);
  }
  if (tether_ > 0) {
    const Eigen::Vector3d at_B(0, 0, -0.01), at_W = torso.R_WB * at_B, from = torso.position_W + at_W - anchor_;
    const double lifted = tether_ * std::max(0.0, from.z());
    const Eigen::Vector3d force(-lifted / 3 * Mechanism::kGravity_m_s2 * from.x(),
                                -lifted / 3 * Mechanism::kGravity_m_s2 * from.y(), -lifted * Mechanism::kGravity_m_s2);
    wrench.force_W += force;
    wrench.torque_W += at_W.cross(force);
  }
  if (downwash_ > 0) {
    const double sideways = torso.velocity_W.head<2>().norm() / 0.7;
    wrench.force_W -=
        torso.R_WB.col(2) * (downwash_ * weight * stroke_rate_squared_ / kHoverRate2 / (1 + sideways * sideways));
  }
  return wrench;
}

}  // namespace flappy::blind::c
