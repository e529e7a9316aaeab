// Effects of place and weather: ground, ceiling, wall, wind, drag, cables. Slow states are updated each millisecond.
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {
namespace {

constexpr double kHalfSpan_m = 0.084;

double square(double x) { return x * x; }

}  // namespace

/// Factor on a wing's lift by ground, ceiling and wall, at 60 % of the span with the stroke at 0.
double Robot::place_gain(std::size_t k) const {
  const Side& s = side_[k];
  const Vector3d middle = x_.torso.position_m +
                          x_.torso.attitude * (s.shoulder_m + Vector3d(0, s.sign * 0.6 * s.planform.wing_length_m, 0));
  double gain = 1;
  if (const double magnitude = magnitudes_[Effect::ground_effect]; magnitude > 0) {
    // Hayden 1976: thrust grows as (A + B (2R/h)^2)^(2/3), A = 0.99, B = 0.038; here 1, 0.05 and an h finite on ground
    const double h2 = square(std::max(middle.z() - room_.ground_z_m, 0.0)) + square(0.05);
    gain *= power(1 + 0.05 * magnitude * square(2 * kHalfSpan_m) / h2, 2.0 / 3);
  }
  if (const double magnitude = magnitudes_[Effect::ceiling_effect]; magnitude > 0) {
    const double d = std::max(room_.ceiling_z_m - middle.z(), 0.0) / 0.08;
    gain *= 1 + 0.1 * magnitude / (1 + d * d * d);
  }
  if (const double magnitude = magnitudes_[Effect::wall_effect]; magnitude > 0) {
    const Wall& wall = room_.wall;
    const double d = (middle.x() - wall.x_m) * wall.normal_x + (middle.y() - wall.y_m) * wall.normal_y;
    gain *= 1 - 0.05 * magnitude * square(0.08 / (0.08 + std::max(d - 0.04, 0.0)));
  }
  return gain;
}

void Robot::update_surroundings(double dt_s) {
  const Torso& t = x_.torso;
  if (const double magnitude = magnitudes_[Effect::wind]; magnitude > 0) {
    // mean wind, and gusts with a spectrum like Dryden's: 1.2 of first-order noise less 0.6 of its low-pass
    constexpr double kTime_s = 0.7, kGust_m_s = 0.1;
    const Vector3d noise = std::sqrt(2 * dt_s / kTime_s) * gust_random_.normals();
    x_.gust_m_s += noise - dt_s / kTime_s * x_.gust_m_s;
    x_.gust_lag_m_s += dt_s / kTime_s * (x_.gust_m_s - x_.gust_lag_m_s);
    const Vector3d gust = 1.2 * x_.gust_m_s - 0.6 * x_.gust_lag_m_s;
    x_.wind_m_s = magnitude * (0.3 * wind_direction_ + kGust_m_s * Vector3d(gust.x(), gust.y(), 0.5 * gust.z()));
  }
  x_.yaw_rate_rad_s += dt_s / 0.05 * (t.rate_rad_s.z() - x_.yaw_rate_rad_s);
  x_.sink_m_s += dt_s / 0.05 * (-t.velocity_m_s.z() - x_.sink_m_s);

  motion_gain_ = 1;
  if (const double magnitude = magnitudes_[Effect::outside_yaw_thrust_loss]; magnitude > 0) {
    const double x2 = square(x_.yaw_rate_rad_s / 2);
    motion_gain_ *= 1 - 0.06 * magnitude * x2 / (1 + x2);
  }
  if (const double magnitude = magnitudes_[Effect::outside_vortex_ring]; magnitude > 0 && x_.sink_m_s > 0) {
    const double x2 = square(x_.sink_m_s / 0.5);  // it sinks into its own wake; the loss is largest at 0.5 m/s
    motion_gain_ *= 1 - std::min(0.12 * magnitude, 0.4) * x2 * exponential(1 - x2);
  }
  if (const double magnitude = magnitudes_[Effect::outside_wing_interference]; magnitude > 0) {
    const double apart = hyperbolic_tangent((x_.side[0].envelope_V - x_.side[1].envelope_V) / 1.0);
    motion_gain_ *= 1 - 0.06 * magnitude * apart * apart;
  }
  x_.density_gain = 1;
  if (const double magnitude = magnitudes_[Effect::outside_humidity_front]; magnitude > 0)
    x_.density_gain += 0.04 * magnitude * hyperbolic_tangent(front_.dot(t.position_m) / 0.1);
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
    // drag of a box: each component of velocity meets the side normal to it
    const Vector3d at(0, 0, -0.008), areas(1.2e-3, 2.2e-3, 1.5e-3);
    const Vector3d v = R_.transpose() * (t.velocity_m_s - x_.wind_m_s) + w.cross(at);
    add_force(at,
              -0.5 * density_kg_m3_ * x_.density_gain * magnitude * areas.cwiseProduct(v.cwiseAbs()).cwiseProduct(v));
  }
  if (const double magnitude = magnitudes_[Effect::wall_effect]; magnitude > 0) {
    const Wall& wall = room_.wall;
    const double d = (t.position_m.x() - wall.x_m) * wall.normal_x + (t.position_m.y() - wall.y_m) * wall.normal_y;
    const double pull = 0.04 * magnitude * weight / (1 + square(square(std::max(d, 0.0) / 0.15)));
    add_force(Vector3d::Zero(), R_.transpose() * Vector3d(-pull * wall.normal_x, -pull * wall.normal_y, 0));
  }
  if (const double magnitude = magnitudes_[Effect::tether]; magnitude > 0) {
    // catenary with its end on the ground: lifted length sqrt(z^2 + 2 z a), a = horizontal pull / weight per length
    constexpr double kLine_kg_m = 2e-4, kPull_m = 0.15, kSpring_N_m = 2e-3;
    const double z = std::max(t.position_m.z() - room_.ground_z_m, 0.0);
    const double line_N_m = kLine_kg_m * room_.gravity_m_s2;
    const double down = line_N_m * std::sqrt(z * z + 2 * z * kPull_m + 1e-12);
    const Vector3d away(t.position_m.x(), t.position_m.y(), 0);
    Vector3d force = -away * (line_N_m * kPull_m / std::sqrt(away.squaredNorm() + 0.04) + kSpring_N_m);
    force.z() = -down;
    add_force({0, 0, -0.012}, magnitude * (R_.transpose() * force));
  }
  if (const double magnitude = magnitudes_[Effect::outside_magnetic_torque]; magnitude > 0)
    rhs_.segment<3>(0) += 1e-4 * magnitude * magnet_.cross(R_.transpose() * field_);
  if (const double magnitude = magnitudes_[Effect::outside_vortex_shedding]; magnitude > 0)
    add_force({0, 0, -0.015}, 0.03 * magnitude * weight * sin_cos(2 * kPi * x_.shedding_turns).sin * shedding_axis_);
  if (const double magnitude = magnitudes_[Effect::outside_slosh]; magnitude > 0) {
    // pendulum of 0.7 g on 2 cm; its acceleration relative to the torso reacts on the torso
    constexpr double kMass_kg = 0.7e-3, kFrequency_rad_s = 22, kRatio = 0.06;
    const Vector3d at(0, 0, -0.01);
    Vector3d felt = specific_force(at);
    felt.z() = 0;
    const Vector3d a = -felt - square(kFrequency_rad_s) * x_.slosh_m - 2 * kRatio * kFrequency_rad_s * x_.slosh_m_s;
    x_.slosh_m_s += step_s_ * a;
    x_.slosh_m += step_s_ * x_.slosh_m_s;
    add_force(at, -kMass_kg * magnitude * a);
  }
}

}  // namespace flappy::blind
