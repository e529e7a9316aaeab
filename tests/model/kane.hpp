// An independent formulation of the five bodies, after Kane: ten generalised speeds (velocity of the torso
// origin and body rate in B, then beta_l, beta_r, theta_l, theta_r), a Jacobian for each body, no
// elimination, no hinge algebra.
#pragma once

#include <Eigen/Dense>
#include <array>

#include "flappy/vehicle.hpp"

namespace flappy::test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Speeds = Eigen::Matrix<double, 10, 1>;

struct KaneState {
  Vector3d velocity_B, body_rate;
  std::array<double, 2> beta, theta, beta_rate, theta_rate;  // left, right
};

/// Of a flapper (flappy/batch.hpp), whose attitude is `R_WB`.
KaneState kane_state_of(const auto& s, const Matrix3d& R_WB) {
  return {R_WB.transpose() * Vector3d(s.velocity_m_s),
          Vector3d(s.body_rate_rad_s),
          {s.stroke_rad[0], -s.stroke_rad[1]},
          {s.rotation_rad[0], s.rotation_rad[1]},
          {s.stroke_rate_rad_s[0], -s.stroke_rate_rad_s[1]},
          {s.rotation_rate_rad_s[0], s.rotation_rate_rad_s[1]}};
}

/// External wrench on each wing at its shoulder, hinge torques, wrench on the torso at its origin; all in B.
struct KaneLoads {
  std::array<Vector3d, 2> force, moment;
  std::array<double, 2> stroke_torque, rotation_torque;
  Vector3d torso_force, torso_moment, gravity_B;
};

struct KaneSystem {
  Eigen::Matrix<double, 10, 10> mass = Eigen::Matrix<double, 10, 10>::Zero();
  Speeds right_side = Speeds::Zero();
  Vector3d com = Vector3d::Zero(), momentum = Vector3d::Zero();  // momentum in B
  double total_mass = 0, kinetic_energy = 0;
  Vector3d angular_momentum_origin = Vector3d::Zero();  // about the torso origin, in B
};

inline Vector3d vec(const model::Triple& t) { return {t.x, t.y, t.z}; }
inline Matrix3d tensor(const model::InertiaTensor& i) {
  Matrix3d m;
  m << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  return m;
}

inline KaneSystem kane(const model::Vehicle& vehicle, const KaneState& x, const KaneLoads& loads) {
  using Jacobian = Eigen::Matrix<double, 3, 10>;
  KaneSystem s;
  Speeds u;
  u << x.velocity_B, x.body_rate, x.beta_rate[0], x.beta_rate[1], x.theta_rate[0], x.theta_rate[1];
  const auto skew = [](const Vector3d& v) {
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
  };
  // angular velocity w = Jw u, its rate at zero u' alpha0; velocity of a point Jv u, its acceleration at zero
  // u' a0
  const auto add_body = [&](const model::RigidBody& body, const Matrix3d& R, const Vector3d& com, const Jacobian& Jw,
                            const Jacobian& Jv, const Vector3d& alpha0, const Vector3d& a0) {
    const Matrix3d I = R * tensor(body.inertia_kg_m2) * R.transpose();
    const Vector3d w = Jw * u, v = Jv * u;
    s.mass += body.mass_kg * Jv.transpose() * Jv + Jw.transpose() * I * Jw;
    s.right_side -=
        Jv.transpose() * (body.mass_kg * (a0 - loads.gravity_B)) + Jw.transpose() * (I * alpha0 + w.cross(I * w));
    s.total_mass += body.mass_kg;
    s.com += body.mass_kg * com;
    s.momentum += body.mass_kg * v;
    s.angular_momentum_origin += I * w + body.mass_kg * com.cross(v);
    s.kinetic_energy += 0.5 * (body.mass_kg * v.squaredNorm() + w.dot(I * w));
  };

  const Vector3d& w0 = x.body_rate;
  const Vector3d origin_acceleration = w0.cross(x.velocity_B);  // of the torso origin at zero u'
  Jacobian Jw0 = Jacobian::Zero(), Jv0 = Jacobian::Zero();
  Jw0.block<3, 3>(0, 3).setIdentity();
  Jv0.block<3, 3>(0, 0).setIdentity();
  const auto point = [&](const Jacobian& Jv, const Jacobian& Jw, const Vector3d& r) -> Jacobian {
    return Jv - skew(r) * Jw;
  };

  const Vector3d torso_com = vec(vehicle.torso.com_m);
  add_body(vehicle.torso, Matrix3d::Identity(), torso_com, Jw0, point(Jv0, Jw0, torso_com), Vector3d::Zero(),
           origin_acceleration + w0.cross(w0.cross(torso_com)));
  s.right_side += Jv0.transpose() * loads.torso_force + Jw0.transpose() * loads.torso_moment;

  for (std::size_t i = 0; i < 2; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const model::Side& side = i == 0 ? vehicle.left : vehicle.right;
    const Vector3d shoulder = vec(side.shoulder_m);
    const Matrix3d Rz = Eigen::AngleAxisd(x.beta[i], Vector3d::UnitZ()).toRotationMatrix();
    const Matrix3d Ry = Rz * Eigen::AngleAxisd(x.theta[i], Vector3d::UnitY()).toRotationMatrix();
    const Vector3d axis_y = Rz * Vector3d::UnitY();
    const Jacobian Jshoulder = point(Jv0, Jw0, shoulder);
    const Vector3d shoulder_acceleration = origin_acceleration + w0.cross(w0.cross(shoulder));

    Jacobian Jw_edge = Jw0;
    Jw_edge.col(6 + column) = Vector3d::UnitZ();
    const Vector3d alpha_edge = w0.cross(Vector3d(0, 0, x.beta_rate[i]));
    const Vector3d w_edge = Jw_edge * u;
    Jacobian Jw_wing = Jw_edge;
    Jw_wing.col(8 + column) = axis_y;
    const Vector3d alpha_wing = alpha_edge + w_edge.cross(x.theta_rate[i] * axis_y);
    const Vector3d w_wing = Jw_wing * u;

    const auto hung = [&](const model::RigidBody& body, const Matrix3d& R, const Jacobian& Jw, const Vector3d& w,
                          const Vector3d& alpha) {
      const Vector3d r = R * vec(body.com_m);
      add_body(body, R, shoulder + r, Jw, point(Jshoulder, Jw, r), alpha,
               shoulder_acceleration + alpha.cross(r) + w.cross(w.cross(r)));
    };
    hung(side.leading_edge, Rz, Jw_edge, w_edge, alpha_edge);
    hung(side.wing, Ry, Jw_wing, w_wing, alpha_wing);
    const model::Motor& m = side.motor;
    // the rotor turns as a body of its own, in place of as much of the torso that does not; of its own energy the gear leaves
    // the share of its efficiency
    const double N = m.gear_ratio, spin = N * m.rotor_spin_sense;
    model::RigidBody rotor{0, {}, {0, 0, m.rotor_inertia_kg_m2, 0, 0, 0}},
        still{0, {}, {0, 0, -m.rotor_inertia_kg_m2, 0, 0, 0}};
    Jacobian Jw_rotor = Jw0;
    Jw_rotor.col(6 + column) = spin * Vector3d::UnitZ();
    add_body(rotor, Matrix3d::Identity(), shoulder, Jw_rotor, Jshoulder,
             w0.cross(Vector3d(0, 0, spin * x.beta_rate[i])), Vector3d::Zero());
    add_body(still, Matrix3d::Identity(), shoulder, Jw0, Jshoulder, Vector3d::Zero(), Vector3d::Zero());
    s.mass(6 + column, 6 + column) += (m.efficiency * N * N - spin * spin) * m.rotor_inertia_kg_m2;
    s.right_side += Jshoulder.transpose() * loads.force[i] + Jw_wing.transpose() * loads.moment[i];
    s.right_side[6 + column] += loads.stroke_torque[i];
    s.right_side[8 + column] += loads.rotation_torque[i];
  }
  s.com /= s.total_mass;
  return s;
}

/// A flapper on which nothing acts, as Kane has it, and its speeds.
struct KaneUnloaded {
  KaneState state;
  KaneSystem system;
  Speeds speeds;
};
KaneUnloaded kane_unloaded(const model::Vehicle& v, const auto& s, const Matrix3d& R_WB) {
  const Vector3d zero = Vector3d::Zero();
  const KaneState k = kane_state_of(s, R_WB);
  Speeds u;
  u << k.velocity_B, k.body_rate, k.beta_rate[0], k.beta_rate[1], k.theta_rate[0], k.theta_rate[1];
  return {k, kane(v, k, {{zero, zero}, {zero, zero}, {0, 0}, {0, 0}, zero, zero, zero}), u};
}

}  // namespace flappy::test
