// Air on the wings, strip by strip, in the frame of the leading edge (x forward, y left, z up; span along +-y).
//   u = psidot r + ... backward, w upward: the strip's velocity in the air    U^2 = u^2 + w^2
//   alpha = theta + sgn(u) pi/2 - atan(w/u)
//   F = 1/2 rho C_N(alpha) c U^2 dr, along the wing's x, at d_cp(alpha) c below the leading edge
//   M_rd = -1/8 rho |thetadot| thetadot C_rd sum of c^4 dr, about y
// C_N and d_cp: Fei et al., ICRA 2019 (arXiv 1902.09628). sin and cos of alpha follow from the velocity without an
// atan.
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

void Robot::blow() {
  const double rho = density_kg_m3_ * x_.density_gain;
  air_ = {};
  const Vector3d &w = x_.torso.rate_rad_s, through_air = R_.transpose() * (x_.torso.velocity_m_s - x_.wind_m_s);

  if (const double magnitude = magnitudes_[Effect::clap_and_fling]; magnitude > 0) {
    // wings that almost touch, behind or in front, separate with extra circulation, which decays in milliseconds
    const double gap_rad = kPi - std::abs(x_.side[0].wing.stroke_rad + x_.side[1].wing.stroke_rad);
    const double met = 0.5 * magnitude / (1 + exponential((gap_rad - 0.4) / 0.07));
    x_.fling = std::max(met, x_.fling * (1 - step_s_ / 4e-3));
  }

  for (const std::size_t k : {0u, 1u}) {
    const Side& s = side_[k];
    RobotSideState& state = x_.side[k];
    const Wing& q = state.wing;
    const Pose& p = pose_[k];
    const Vector3d shoulder = p.edge.transpose() * (through_air + w.cross(s.shoulder_m));
    const Vector3d rate = p.edge.transpose() * p.edge_rate;
    const double stroking = s.sign * rate.z(), lifting = s.sign * rate.x();
    const SinCos rotation = sin_cos(q.rotation_rad);

    double memory = 0;  // after stroke reversal a wing meets the air that it has set in motion
    if (const double magnitude = magnitudes_[Effect::wake_capture]; magnitude > 0) {
      state.wake_rad_s += step_s_ / 3e-3 * (q.stroke_rad_s - state.wake_rad_s);
      if (state.wake_rad_s * q.stroke_rad_s < 0) memory = -0.15 * magnitude * state.wake_rad_s;
    }
    const double twist = state.twist_rad, span = s.planform.wing_length_m;
    const double rotational = magnitudes_[Effect::rotational_lift] * 0.75 * kPi * rho * q.rotation_rad_s;
    const double pressure = 0.5 * rho * s.strips.width_m;
    // The gain acts on lift alone, as it stands for a lower induced velocity.
    const double lift_gain = state.air_gain * (1 + x_.fling) * motion_gain_;

    double force_x = 0, force_z = 0, moment_x = 0, moment_y = 0, moment_z = 0, twisting = 0;
    for (std::size_t i = 0; i < kStrips; ++i) {
      const double r = s.strips.r_m[i], c = s.strips.chord_m[i];
      const double u = (stroking + memory) * r - shoulder.x(), up = lifting * r + shoulder.z();
      const double speed2 = u * u + up * up + 1e-12, per_speed = 1 / std::sqrt(speed2);
      const double bent = twist * r / span;  // small angle: a second-order expansion is enough
      const double sin_t = rotation.sin + bent * (rotation.cos - 0.5 * bent * rotation.sin);
      const double cos_t = rotation.cos - bent * (rotation.sin + 0.5 * bent * rotation.cos);
      const double way = std::copysign(1.0, u);
      const double cos_f = std::abs(u) * per_speed, sin_f = way * up * per_speed;
      // alpha = (theta - f) + way pi/2
      const double sa = way * (cos_t * cos_f + sin_t * sin_f), ca = -way * (sin_t * cos_f - cos_t * sin_f);
      const double c2 = ca * ca;
      const double normal = sa * (3.6 * c2 + 1.95 - 1.5 * (2 * c2 - 1));
      const double centre = 0.46 - ca * (0.332 + 0.037 * (4 * c2 - 3) + 0.013 * (16 * c2 * c2 - 20 * c2 + 5));
      double f = pressure * s.kept[i] * c * normal * speed2;
      double arm = centre * c;
      if (rotational != 0) {
        // circulation of the pitching strip at half chord, limited at high rates. On either stroke thetadot > 0 moves
        // flow at 3/4 chord to a larger C_N (Sane and Dickinson 2002): pitching up adds force
        const double limited = 1 / (1 + std::abs(q.rotation_rad_s) * c / 40);
        const double extra = rotational * limited * s.kept[i] * s.strips.width_m * c * c / per_speed;
        arm = std::abs(f + extra) > 1e-9 ? (f * arm + extra * 0.5 * c) / (f + extra) : 0.5 * c;
        f += extra;
      }
      force_x += f * cos_t;
      force_z -= f * sin_t;
      moment_x -= r * f * sin_t;
      moment_y -= arm * f;
      moment_z -= r * f * cos_t;
      twisting -= arm * f * r;
    }
    force_z *= lift_gain;
    moment_x *= lift_gain;
    moment_y -= 0.125 * rho * std::abs(q.rotation_rad_s) * q.rotation_rad_s *
                s.planform.rotational_damping_coefficient * s.fourth_m5;
    if (const double magnitude = magnitudes_[Effect::wing_flexibility]; magnitude > 0) {
      // one twist mode, linear along the span, which follows the load with a time constant of 1 ms
      constexpr double kTwist_Nm_rad = 8e-3, kTwist_s = 1e-3;
      state.twist_rad +=
          step_s_ / kTwist_s * (std::clamp(magnitude * twisting / span / kTwist_Nm_rad, -0.6, 0.6) - twist);
    }
    const Vector3d force = p.edge * Vector3d(force_x, 0, force_z);
    const Vector3d moment = p.edge * Vector3d(s.sign * moment_x, moment_y, s.sign * moment_z);
    air_.force_N += force;
    air_.moment_Nm += moment + s.shoulder_m.cross(force);
    const int stroke = 6 + 2 * static_cast<int>(k);
    rhs_(stroke) += p.stroke_axis.dot(moment);
    rhs_(stroke + 1) += p.rotation_axis.dot(moment);
    if (magnitudes_.has(Effect::added_mass)) add_added_mass(k);
  }
  rhs_.segment<3>(0) += air_.moment_Nm;
  rhs_.segment<3>(3) += air_.force_N;
}

/// Added mass of a strip, rho pi/4 c^2 dr at half chord, times the rate of n.v. The part of n.a linear in the unknowns
/// goes into the mass matrix; v.(rate x n) and the rest are known and go to the right-hand side.
void Robot::add_added_mass(std::size_t k) {
  const Side& s = side_[k];
  const Pose& p = pose_[k];
  const Vector3d& w = x_.torso.rate_rad_s;
  const Vector3d n = p.wing.col(0), turning_n = p.wing_rate.cross(n);
  const Vector3d shoulder_v = R_.transpose() * x_.torso.velocity_m_s + w.cross(s.shoulder_m);
  const Vector3d shoulder_a = w.cross(w.cross(s.shoulder_m));
  const int stroke = 6 + 2 * static_cast<int>(k);
  const double scale = magnitudes_[Effect::added_mass] * density_kg_m3_ * x_.density_gain * kPi / 4 * s.strips.width_m;
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double c = s.strips.chord_m[i], mass = scale * s.kept[i] * c * c;
    const Vector3d r = s.sign * s.strips.r_m[i] * p.wing.col(1) - 0.5 * c * p.wing.col(2);
    Eigen::Matrix<double, 8, 1> row;
    row << (s.shoulder_m + r).cross(n), n, n.dot(p.stroke_axis.cross(r)), n.dot(p.rotation_axis.cross(r));
    const double known = n.dot(shoulder_a + p.wing_turning.cross(r) + p.wing_rate.cross(p.wing_rate.cross(r))) +
                         turning_n.dot(shoulder_v + p.wing_rate.cross(r));
    for (int a = 0; a < 8; ++a) {
      const int ra = a < 6 ? a : stroke + a - 6;
      rhs_(ra) -= mass * row(a) * known;
      for (int b = 0; b <= a; ++b) mass_matrix_(ra, b < 6 ? b : stroke + b - 6) += mass * row(a) * row(b);
    }
  }
}

}  // namespace flappy::blind
