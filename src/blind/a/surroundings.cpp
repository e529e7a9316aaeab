// What the place and the weather do: ground, ceiling, wall, wind, drag, cables. Slow things change each millisecond.
#include "blind/a/robot.hpp"

namespace flappy::blind {
namespace {

constexpr double kHalfSpan_m = 0.084;

double square(double x) { return x * x; }

}  // namespace

/// Gain of a wing's force from where it flies: its middle, with the stroke at rest.
double Robot::place_gain(std::size_t k) const {
  const Side& s = side_[k];
  const Vector3d middle = x_.torso.position_m +
                          x_.torso.attitude * (s.shoulder_m + Vector3d(0, s.sign * 0.6 * s.planform.wing_length_m, 0));
  double gain = 1;
  if (const double size = sizes_[Effect::ground_effect]; size > 0) {
    // Hayden 1976: at constant power thrust grows as (A + B (2R/h)^2)^(2/3), A = 0.99, B = 0.038; here 1, 0.05, finite on the ground
    const double h2 = square(std::max(middle.z() - room_.ground_z_m, 0.0)) + square(0.05);
    gain *= power(1 + 0.05 * size * square(2 * kHalfSpan_m) / h2, 2.0 / 3);
  }
  if (const double size = sizes_[Effect::ceiling_effect]; size > 0) {
    const double d = std::max(room_.ceiling_z_m - middle.z(), 0.0) / 0.08;
    gain *= 1 + 0.1 * size / (1 + d * d * d);
  }
  if (const double size = sizes_[Effect::wall_effect]; size > 0) {
    const Wall& wall = room_.wall;
    const double d = (middle.x() - wall.x_m) * wall.normal_x + (middle.y() - wall.y_m) * wall.normal_y;
    gain *= 1 - 0.05 * size * square(0.08 / (0.08 + std::max(d - 0.04, 0.0)));
  }
  return gain;
}

void Robot::update_surroundings(double dt_s) {
  const Torso& t = x_.torso;
  if (const double size = sizes_[Effect::wind]; size > 0) {
    // a mean, and gusts of Dryden's shape: first order plus a share of a second lag
    constexpr double kTime_s = 0.7, kGust_m_s = 0.1;
    const Vector3d noise = std::sqrt(2 * dt_s / kTime_s) * gust_random_.normals();
    x_.gust_m_s += noise - dt_s / kTime_s * x_.gust_m_s;
    x_.gust_lag_m_s += dt_s / kTime_s * (x_.gust_m_s - x_.gust_lag_m_s);
    const Vector3d gust = 1.2 * x_.gust_m_s - 0.6 * x_.gust_lag_m_s;
    x_.wind_m_s = size * (0.3 * wind_direction_ + kGust_m_s * Vector3d(gust.x(), gust.y(), 0.5 * gust.z()));
  }
  x_.yaw_rate_rad_s += dt_s / 0.05 * (t.rate_rad_s.z() - x_.yaw_rate_rad_s);
  x_.sink_m_s += dt_s / 0.05 * (-t.velocity_m_s.z() - x_.sink_m_s);

  motion_gain_ = 1;
  if (const double size = sizes_[Effect::outside_yaw_thrust_loss]; size > 0) {
    const double x2 = square(x_.yaw_rate_rad_s / 2);
    motion_gain_ *= 1 - 0.06 * size * x2 / (1 + x2);
  }
  if (const double size = sizes_[Effect::outside_vortex_ring]; size > 0 && x_.sink_m_s > 0) {
    const double x2 = square(x_.sink_m_s / 0.5);  // it sinks into its own wake, worst at half a metre per second
    motion_gain_ *= 1 - std::min(0.12 * size, 0.4) * x2 * exponential(1 - x2);
  }
  if (const double size = sizes_[Effect::outside_wing_interference]; size > 0) {
    const double apart = hyperbolic_tangent((x_.side[0].envelope_V - x_.side[1].envelope_V) / 1.0);
    motion_gain_ *= 1 - 0.06 * size * apart * apart;
  }
  x_.density_gain = 1;
  if (const double size = sizes_[Effect::outside_humidity_front]; size > 0)
    x_.density_gain += 0.04 * size * hyperbolic_tangent(front_.dot(t.position_m) / 0.1);
  for (const std::size_t k : {0u, 1u}) x_.side[k].air_gain = place_gain(k);

  if (sizes_.has(Effect::outside_vortex_shedding)) {
    const double speed = std::sqrt((t.velocity_m_s - x_.wind_m_s).squaredNorm());
    x_.shedding_turns += dt_s * shedding_Hz_ * (1 + 0.4 * std::min(speed, 1.0));
    x_.shedding_turns -= std::floor(x_.shedding_turns);
  }
}

/// Forces and torques on the torso.
void Robot::push() {
  const Torso& t = x_.torso;
  const double weight = mass_kg_ * room_.gravity_m_s2;
  const Vector3d& w = t.rate_rad_s;
  if (const double size = sizes_[Effect::body_drag]; size > 0) {
    // flat sides of a box: each area meets its own component
    const Vector3d at(0, 0, -0.008), areas(1.2e-3, 2.2e-3, 1.5e-3);
    const Vector3d v = R_.transpose() * (t.velocity_m_s - x_.wind_m_s) + w.cross(at);
    add_force(at, -0.5 * density_kg_m3_ * x_.density_gain * size * areas.cwiseProduct(v.cwiseAbs()).cwiseProduct(v));
  }
  if (const double size = sizes_[Effect::wall_effect]; size > 0) {
    const Wall& wall = room_.wall;
    const double d = (t.position_m.x() - wall.x_m) * wall.normal_x + (t.position_m.y() - wall.y_m) * wall.normal_y;
    const double pull = 0.04 * size * weight / (1 + square(square(std::max(d, 0.0) / 0.15)));
    add_force(Vector3d::Zero(), R_.transpose() * Vector3d(-pull * wall.normal_x, -pull * wall.normal_y, 0));
  }
  if (const double size = sizes_[Effect::tether]; size > 0) {
    // a catenary that lies on the ground: the lifted length is sqrt(z^2 + 2 z a), a = horizontal pull / weight per length
    constexpr double kLine_kg_m = 2e-4, kPull_m = 0.15, kSpring_N_m = 2e-3;
    const double z = std::max(t.position_m.z() - room_.ground_z_m, 0.0);
    const double line_N_m = kLine_kg_m * room_.gravity_m_s2;
    const double down = line_N_m * std::sqrt(z * z + 2 * z * kPull_m + 1e-12);
    const Vector3d away(t.position_m.x(), t.position_m.y(), 0);
    Vector3d force = -away * (line_N_m * kPull_m / std::sqrt(away.squaredNorm() + 0.04) + kSpring_N_m);
    force.z() = -down;
    add_force({0, 0, -0.012}, size * (R_.transpose() * force));
  }
  if (const double size = sizes_[Effect::outside_magnetic_torque]; size > 0)
    rhs_.segment<3>(0) += 1e-4 * size * magnet_.cross(R_.transpose() * field_);
  if (const double size = sizes_[Effect::outside_vortex_shedding]; size > 0)
    add_force({0, 0, -0.015}, 0.03 * size * weight * sin_cos(2 * kPi * x_.shedding_turns).sin * shedding_axis_);
  if (const double size = sizes_[Effect::outside_slosh]; size > 0) {
    // 0.7 g hang on 2 cm; what they do beyond going along with the torso acts on it
    constexpr double kMass_kg = 0.7e-3, kFrequency_rad_s = 22, kRatio = 0.06;
    const Vector3d at(0, 0, -0.01);
    Vector3d felt = specific_force(at);
    felt.z() = 0;
    const Vector3d a = -felt - square(kFrequency_rad_s) * x_.slosh_m - 2 * kRatio * kFrequency_rad_s * x_.slosh_m_s;
    x_.slosh_m_s += step_s_ * a;
    x_.slosh_m += step_s_ * x_.slosh_m_s;
    add_force(at, -kMass_kg * size * a);
  }
}

}  // namespace flappy::blind
