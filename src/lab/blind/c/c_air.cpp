// Laws and numbers: c_laws.hpp. Surfaces change each wing's force, as Tu et al., Acting is seeing: navigating tight space using
// flapping wings, ICRA 2019, found of this robot. Downwash on the torso: choice.
#include "lab/blind/c/c_air.hpp"

#include "lab/blind/c/c_laws.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kHoverRate2 = 2.9e4;  // mean square of the stroke rate of the nominal robot in hover, rad^2/s^2

}  // namespace

Eigen::Vector3d reach_W(const RobotParameters& parameters, const Motion& torso, std::size_t side, double stroke_rad,
                        double radius_m) {
  const double out = side == 0 ? 1 : -1;
  const Eigen::Vector3d along(-std::sin(stroke_rad), out * std::cos(stroke_rad), 0);
  return torso.position_W + torso.R_WB * (parameters.sides[side].shoulder_m + radius_m * along);
}

Air::Air(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight)
    : parameters_(&parameters),
      ground_(magnitudes[Effect::kGround]),
      ceiling_(magnitudes[Effect::kCeiling]),
      wall_(magnitudes[Effect::kWall]),
      wake_(magnitudes[Effect::kWakeCapture]),
      fling_(magnitudes[Effect::kClapAndFling]),
      flexibility_(magnitudes[Effect::kWingFlexibility]),
      wind_(magnitudes[Effect::kWind]),
      tether_(magnitudes[Effect::kTether]),
      downwash_(0.03 * magnitudes[Effect::kDownwashOnBody]),
      snap_(magnitudes[Effect::kCamberSnap]),
      random_(seed, "gusts", flight),
      any_factor_(ground_ + ceiling_ + wall_ + wake_ + fling_ + snap_ > 0) {
  Random once(seed, "air");
  const double heading = once.uniform(0, 2 * M_PI);
  mean_wind_ = laws::kWind_m_s * wind_ * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0);
  anchor_.z() = Room::kGround_m;
  anchor_.y() = once.uniform(-0.3, 0.3);
  anchor_.x() = once.uniform(-0.3, 0.3);
  rising_ = random_.normal3();
  falling_ = random_.normal3();
  pulse_ = random_.uniform(0, 0.5);
}

std::pair<double, double> Air::room(const Mechanism& mechanism, const Motion& torso, std::size_t side) const {
  const double length = parameters_->sides[side].planform.length_m, stroke = mechanism.stroke(side);
  double more = 0, pull = 0;
  if (ground_ + ceiling_ > 0) {
    const double z = reach_W(*parameters_, torso, side, stroke, laws::kTravelRadius * length).z();
    if (ground_ > 0) more += ground_ * laws::ground_share(z - Room::kGround_m);
    if (ceiling_ > 0) more += ceiling_ * laws::ceiling_share(Room::kCeiling_m - z);
  }
  if (wall_ > 0) {
    const double near = laws::wall_nearness(Room::kWall_m - reach_W(*parameters_, torso, side, stroke, length).y());
    more -= wall_ * laws::kWallLoss * near;
    pull = wall_ * laws::kWallPull * near;
  }
  return {more, pull};
}

double Air::wing_factor(std::size_t side) const {
  const double chords = travelled_m_[side] / parameters_->sides[side].planform.chord_m;
  double factor = 1;
  if (wake_ > 0) factor += wake_ * laws::wake_share(chords);
  if (fling_ > 0) factor += fling_ * laws::fling_share(met_rad_[side], opened_rad_[side], chords);
  return factor;
}

void Air::blow(Mechanism& mechanism, double step_s) {
  pulse_ += step_s / laws::kGust_s;
  if (pulse_ >= 0.5) {
    pulse_ -= 0.5;
    falling_ = rising_;
    rising_ = random_.normal3();
  }
  const Eigen::Vector3d gust = laws::gust_pulse(pulse_) * rising_ + laws::gust_pulse(pulse_ + 0.5) * falling_;
  const double size = wind_ * laws::kGust_m_s / std::sqrt(laws::kGustSquare);
  mechanism.set_wind(mean_wind_ + size * gust.cwiseProduct(Eigen::Vector3d(1, 1, 0.5)));
}

Wrench Air::act(Mechanism& mechanism, double step_s) {
  Wrench wrench;
  const Motion torso = mechanism.motion();
  const double weight = parameters_->mass_kg() * Mechanism::kGravity_m_s2;
  if (wind_ > 0) blow(mechanism, step_s);
  const double gap_rad = std::max(0.0, M_PI - std::abs(mechanism.stroke(0) + mechanism.stroke(1)));
  for (std::size_t side = 0; side < 2; ++side) {
    const double rate = mechanism.stroke_rate(side), moment = mechanism.hinge_torque(side);
    if (rate * direction_[side] <= 0) {
      direction_[side] = rate < 0 ? -1 : 1;
      travelled_m_[side] = 0;
      met_rad_[side] = gap_rad;  // of the wings when this one reverses, in front of or behind the body
    }
    opened_rad_[side] = std::max(0.0, gap_rad - met_rad_[side]);
    travelled_m_[side] += std::abs(rate) * laws::kTravelRadius * parameters_->sides[side].planform.length_m * step_s;
    if (any_factor_) {
      const auto [more, pull] = room(mechanism, torso, side);
      double factor = (1 + more) * wing_factor(side);
      wrench.force_W.y() += pull * weight;
      if (snap_ > 0) {
        if (std::abs(moment) > laws::kSnap_Nm) camber_to_[side] = moment < 0 ? -1 : 1;
        camber_[side] += (1 - std::exp(-step_s / laws::kSnapTime_s)) * (camber_to_[side] - camber_[side]);
        factor *= 1 - std::min(0.9, snap_ * laws::kSnapLoss) *
                          (1 - camber_[side] * laws::soft_sign(moment, 0.1 * laws::kSnap_Nm)) / 2;
      }
      for (std::size_t i = 0; i < Mechanism::kStrips; ++i) mechanism.scale_air(side, i, factor);
    }
    if (flexibility_ > 0) {
      twist_rad_[side] +=
          (1 - std::exp(-step_s / laws::kFlexTime_s)) * (laws::flex_rad(moment, flexibility_) - twist_rad_[side]);
      mechanism.twist(side, twist_rad_[side]);
    }
    if (downwash_ > 0)
      stroke_rate_squared_ += (1 - std::exp(-step_s / 0.015)) / 2 * (rate * rate - stroke_rate_squared_);
  }
  if (tether_ > 0) {
    const Eigen::Vector3d at_W = torso.R_WB * Eigen::Vector3d(0, 0, -0.01);
    const Eigen::Vector3d force = tether_ * laws::tether_N(torso.position_W + at_W - anchor_, Mechanism::kGravity_m_s2);
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
