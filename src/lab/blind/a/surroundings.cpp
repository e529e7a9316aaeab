// Effects of place and weather: ground, ceiling, wall, wind, drag, cables. Slow states are updated each millisecond.
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {
using laws::square;

/// Factor on a wing's lift by ground, ceiling and wall, at kLiftStation with the stroke at 0.
double Robot::place_gain(std::size_t k) const {
  const Side& s = side_[k];
  const Vector3d middle =
      x_.torso.position_m +
      x_.torso.attitude * (s.shoulder_m + Vector3d(0, s.sign * kLiftStation * s.planform.wing_length_m, 0));
  double gain = 1;
  if (const double magnitude = magnitudes_[Effect::ground_effect]; magnitude > 0)
    gain *= 1 + magnitude * laws::ground(middle.z() - room_.ground_z_m);
  if (const double magnitude = magnitudes_[Effect::ceiling_effect]; magnitude > 0)
    gain *= 1 + magnitude * laws::ceiling(room_.ceiling_z_m - middle.z());
  if (const double magnitude = magnitudes_[Effect::wall_effect]; magnitude > 0) {
    const Wall& wall = room_.wall;
    const double d = (middle.x() - wall.x_m) * wall.normal_x + (middle.y() - wall.y_m) * wall.normal_y;
    gain *= 1 - magnitude * laws::wall_loss(d);
  }
  return gain;
}

void Robot::update_surroundings(double dt_s) {
  const Torso& t = x_.torso;
  if (const double magnitude = magnitudes_[Effect::wind]; magnitude > 0) {
    const Vector3d gust = laws::gust_step(x_.gust, gust_random_.normals(), dt_s);
    const double mean_m_s = laws::kWind_m_s * laws::wind_profile(t.position_m.z() - room_.ground_z_m);
    // floor and ceiling hold vertical gusts back
    x_.wind_m_s =
        magnitude * (mean_m_s * wind_direction_ + laws::kGust_m_s * Vector3d(gust.x(), gust.y(), 0.53 * gust.z()));
  }
  x_.yaw_rate_rad_s += dt_s / 0.05 * (t.rate_rad_s.z() - x_.yaw_rate_rad_s);
  x_.sink_m_s += dt_s / 0.05 * (-t.velocity_m_s.z() - x_.sink_m_s);

  motion_gain_ = 1;
  if (const double magnitude = magnitudes_[Effect::outside_yaw_thrust_loss]; magnitude > 0) {
    const double x2 = square(x_.yaw_rate_rad_s / laws::kYawLoss_rad_s);
    motion_gain_ *= 1 - laws::kYawLoss * magnitude * x2 / (1 + x2);
  }
  if (const double magnitude = magnitudes_[Effect::outside_vortex_ring]; magnitude > 0 && x_.sink_m_s > 0) {
    const double x2 =
        square(x_.sink_m_s / laws::kRing_m_s);  // it sinks into its own wake; the loss is largest at 0.5 m/s
    motion_gain_ *= 1 - std::min(laws::kRing * magnitude, 0.4) * x2 * exponential(1 - x2);
  }
  if (const double magnitude = magnitudes_[Effect::outside_wing_interference]; magnitude > 0) {
    const double apart = hyperbolic_tangent((x_.side[0].envelope_V - x_.side[1].envelope_V) / laws::kInterference_V);
    motion_gain_ *= 1 - laws::kInterference * magnitude * apart * apart;
  }
  x_.density_gain = 1;
  if (const double magnitude = magnitudes_[Effect::outside_humidity_front]; magnitude > 0)
    x_.density_gain += laws::kFront * magnitude * hyperbolic_tangent(front_.dot(t.position_m) / laws::kFront_m);
  for (const std::size_t k : {0u, 1u}) x_.side[k].air_gain = place_gain(k);

  if (magnitudes_.has(Effect::outside_vortex_shedding)) {
    const double speed = std::sqrt((t.velocity_m_s - x_.wind_m_s).squaredNorm());
    x_.shedding_turns += dt_s * shedding_Hz_ * (1 + 0.4 * std::min(speed, 1.0));
    x_.shedding_turns -= std::floor(x_.shedding_turns);
  }
}

void Robot::push() {
  const Torso& t = x_.torso;
  const double weight = mass_kg_ * room_.gravity_m_s2;
  const Vector3d& w = t.rate_rad_s;
  if (const double magnitude = magnitudes_[Effect::body_drag]; magnitude > 0) {
    const Vector3d at(0, 0, -0.008);
    const Vector3d v = R_.transpose() * (t.velocity_m_s - x_.wind_m_s) + w.cross(at);
    add_force(at, magnitude * laws::body_drag(v, density_kg_m3_ * x_.density_gain));
  }
  if (const double magnitude = magnitudes_[Effect::wall_effect]; magnitude > 0) {
    const Wall& wall = room_.wall;
    const double d = (t.position_m.x() - wall.x_m) * wall.normal_x + (t.position_m.y() - wall.y_m) * wall.normal_y;
    const double pull = magnitude * weight * laws::wall_pull(d);
    add_force(Vector3d::Zero(), R_.transpose() * Vector3d(-pull * wall.normal_x, -pull * wall.normal_y, 0));
  }
  if (const double magnitude = magnitudes_[Effect::tether]; magnitude > 0) {
    const Vector3d from_anchor = t.position_m - Vector3d(0, 0, room_.ground_z_m);
    add_force({0, 0, -0.012}, magnitude * (R_.transpose() * laws::tether(from_anchor, room_.gravity_m_s2)));
  }
  if (const double magnitude = magnitudes_[Effect::outside_magnetic_torque]; magnitude > 0)
    rhs_.segment<3>(0) += laws::kMagnetic_Nm * magnitude * magnet_.cross(R_.transpose() * field_);
  if (const double magnitude = magnitudes_[Effect::outside_vortex_shedding]; magnitude > 0)
    add_force({0, 0, -0.015},
              laws::kShedding * magnitude * weight * sin_cos(2 * kPi * x_.shedding_turns).sin * shedding_axis_);
  if (const double magnitude = magnitudes_[Effect::outside_slosh]; magnitude > 0) {
    // a pendulum; its acceleration relative to the torso reacts on the torso
    const Vector3d at(0, 0, -0.01);
    Vector3d felt = specific_force(at);
    felt.z() = 0;
    const Vector3d a =
        -felt - square(laws::kSlosh_rad_s) * x_.slosh_m - 2 * laws::kSloshDamping * laws::kSlosh_rad_s * x_.slosh_m_s;
    x_.slosh_m_s += step_s_ * a;
    x_.slosh_m += step_s_ * x_.slosh_m_s;
    add_force(at, -laws::kSlosh_kg * magnitude * a);
  }
}

}  // namespace flappy::blind
