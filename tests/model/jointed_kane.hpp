// An independent formulation of a torso and two wings of four angles each, after Kane: fourteen generalised speeds, a Jacobian for each body in B, all
// joint accelerations unknown at first; those that are prescribed are moved to the right-hand side afterwards, and their rows give the torques.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <random>

#include "flappy/vehicle.hpp"

namespace flappy::test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class Random {
 public:
  explicit Random(std::uint64_t seed = 11) : engine_(seed) {}
  double operator()(double scale) { return scale * std::uniform_real_distribution<double>(-1, 1)(engine_); }
  double within(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vector3d vector(double scale) { return {(*this)(scale), (*this)(scale), (*this)(scale)}; }
  int whole(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }

 private:
  std::mt19937_64 engine_;
};

/// At one instant; force and moment of the air on each wing at its shoulder, in B.
struct JointedState {
  struct Joint {
    double angle, rate, acceleration, torque;  // acceleration: where prescribed; torque: where free
  };
  Vector3d velocity_B, body_rate, gravity_B;
  std::array<std::array<Joint, 4>, 2> joints;
  std::array<Vector3d, 2> force, moment;
};

struct JointedAnswer {
  Vector3d acceleration, angular_acceleration;
  std::array<std::array<double, 4>, 2> joint, torque;
};

/// A vehicle with nothing symmetric, of random modes and no air.
inline model::Vehicle random_jointed(Random& random) {
  const auto body = [&](double mass, double size) {
    model::RigidBody b;
    b.mass_kg = mass * random.within(0.7, 1.3);
    b.com_m = {random(size), random(size), random(size)};
    const double i = b.mass_kg * size * size / 3;
    b.inertia_kg_m2 = {i * random.within(0.8, 1.2),
                       i * random.within(0.8, 1.2),
                       i * random.within(0.8, 1.2),
                       random(0.2 * i),
                       random(0.2 * i),
                       random(0.2 * i)};
    return b;
  };
  model::Vehicle v;
  v.name = "random";
  v.torso = body(5e-3, 0.01);
  v.air_density_kg_m3 = 1.2;
  v.jointed.emplace();
  v.jointed->frequency_Hz = random.within(20, 40);
  for (model::Side* s : {&v.left, &v.right}) {
    s->shoulder_m = {random(5e-3), random(8e-3), random(5e-3)};
    s->leading_edge = body(3e-4, 0.015);
    s->wing = body(3e-4, 0.02);
  }
  for (model::Jointed::Wing* w : {&v.jointed->left, &v.jointed->right})
    for (model::Jointed::Angle& a : w->angles) {
      a.mode = static_cast<model::Jointed::Mode>(random.whole(3));
      a.mean_rad = random(0.2);
      if (a.mode == model::Jointed::Mode::driven)
        a.cos_rad = {random(0.4), random(0.1)}, a.sin_rad = {random(0.4), random(0.1)};
      if (a.mode == model::Jointed::Mode::free)
        a.stiffness_Nm_rad = random.within(1e-3, 5e-3), a.rest_rad = random(0.3), a.damping_Nm_s = 1e-6;
    }
  return v;
}

inline JointedState random_state(Random& random, const model::Vehicle& v) {
  JointedState x;
  x.velocity_B = random.vector(3);
  x.body_rate = random.vector(40);
  x.gravity_B = random.vector(9.81);
  for (std::size_t side = 0; side < 2; ++side) {
    x.force[side] = random.vector(0.1);
    x.moment[side] = random.vector(1e-3);
    const model::Jointed::Wing& w = side == 0 ? v.jointed->left : v.jointed->right;
    for (std::size_t j = 0; j < 4; ++j) {
      const bool fixed = w.angles[j].mode == model::Jointed::Mode::fixed;
      x.joints[side][j] = {random(1.2), fixed ? 0 : random(300), fixed ? 0 : random(1e5), random(1e-3)};
    }
  }
  return x;
}

inline JointedAnswer jointed_kane(const model::Vehicle& v, const JointedState& x,
                                  const std::array<Matrix3d, 2>& added = {Matrix3d::Zero(), Matrix3d::Zero()},
                                  bool held = false) {
  constexpr int kAll = 14;
  using Jacobian = Eigen::Matrix<double, 3, kAll>;
  using Row = Eigen::Matrix<double, kAll, 1>;
  const auto vec = [](const model::Triple& t) { return Vector3d(t.x, t.y, t.z); };
  const auto skew = [](const Vector3d& a) {
    Matrix3d m;
    m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return m;
  };
  Eigen::Matrix<double, kAll, kAll> M = Eigen::Matrix<double, kAll, kAll>::Zero();
  Row f = Row::Zero();
  /// Of a frame that turns: rate and its Jacobian, acceleration at zero u'.
  struct Frame {
    Matrix3d R;
    Vector3d w, alpha;
    Jacobian J;
  };
  const auto add_body = [&](const model::RigidBody& b, const Frame& frame, const Vector3d& at, const Jacobian& J_at,
                            const Vector3d& a_at) {
    const model::InertiaTensor& t = b.inertia_kg_m2;
    Matrix3d I;
    I << t.xx, t.xy, t.xz, t.xy, t.yy, t.yz, t.xz, t.yz, t.zz;
    I = frame.R * I * frame.R.transpose();
    const Vector3d r = frame.R * vec(b.com_m);
    const Jacobian J = J_at - skew(r) * frame.J;
    const Vector3d a = a_at + frame.alpha.cross(r) + frame.w.cross(frame.w.cross(r));
    M += b.mass_kg * J.transpose() * J + frame.J.transpose() * I * frame.J;
    f -= J.transpose() * (b.mass_kg * (a - x.gravity_B)) +
         frame.J.transpose() * (I * frame.alpha + frame.w.cross(I * frame.w));
    (void)at;
  };
  Frame torso{Matrix3d::Identity(), x.body_rate, Vector3d::Zero(), Jacobian::Zero()};
  torso.J.block<3, 3>(0, 3).setIdentity();
  Jacobian J_origin = Jacobian::Zero();
  J_origin.block<3, 3>(0, 0).setIdentity();
  add_body(v.torso, torso, Vector3d::Zero(), J_origin, Vector3d::Zero());
  for (std::size_t side = 0; side < 2; ++side) {
    const model::Side& s = side == 0 ? v.left : v.right;
    const double sign = side == 0 ? 1 : -1;
    const Vector3d shoulder = vec(s.shoulder_m);
    const Jacobian J_s = J_origin - skew(shoulder) * torso.J;
    const Vector3d a_s = torso.w.cross(torso.w.cross(shoulder));
    const Vector3d axes[4] = {-Vector3d::UnitY(), sign * Vector3d::UnitZ(), sign * Vector3d::UnitX(),
                              Vector3d::UnitY()};
    Frame frame = torso;
    for (std::size_t j = 0; j < 4; ++j) {
      const auto& q = x.joints[side][j];
      const Vector3d e = frame.R * axes[j];
      frame.alpha += frame.w.cross(q.rate * e);
      frame.w += q.rate * e;
      frame.J.col(static_cast<Eigen::Index>(6 + 4 * side + j)) += e;
      frame.R = frame.R * Eigen::AngleAxisd(q.angle, axes[j]).toRotationMatrix();
      if (j == 2) add_body(s.leading_edge, frame, shoulder, J_s, a_s);
    }
    add_body(s.wing, frame, shoulder, J_s, a_s);
    // air carried along: K on the rate of (v_x, w_y, w_z) in the wing's axes
    Jacobian rows;
    const Vector3d normal = frame.R.col(0), v_s = x.velocity_B + torso.w.cross(shoulder);
    rows.row(0) = normal.transpose() * J_s;
    rows.row(1) = frame.R.col(1).transpose() * frame.J;
    rows.row(2) = frame.R.col(2).transpose() * frame.J;
    const Vector3d bias(normal.dot(a_s) - normal.dot(frame.w.cross(v_s)), frame.R.col(1).dot(frame.alpha),
                        frame.R.col(2).dot(frame.alpha));
    M += rows.transpose() * added[side] * rows;
    f -= rows.transpose() * (added[side] * bias);
    f += J_s.transpose() * x.force[side] + frame.J.transpose() * x.moment[side];
  }
  std::vector<Eigen::Index> unknown;
  Row u = Row::Zero();
  for (Eigen::Index i = 0; i < 6 && !held; ++i) unknown.push_back(i);
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t j = 0; j < 4; ++j) {
      const auto i = static_cast<Eigen::Index>(6 + 4 * side + j);
      const model::Jointed::Wing& w = side == 0 ? v.jointed->left : v.jointed->right;
      if (w.angles[j].mode == model::Jointed::Mode::free) unknown.push_back(i);
      else u[i] = x.joints[side][j].acceleration;
    }
  Row right = f - M * u;
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t j = 0; j < 4; ++j) right[static_cast<Eigen::Index>(6 + 4 * side + j)] += x.joints[side][j].torque;
  const Eigen::MatrixXd A = M(unknown, unknown);
  const Eigen::VectorXd solution = A.ldlt().solve(Eigen::VectorXd(right(unknown)));
  for (std::size_t i = 0; i < unknown.size(); ++i) u[unknown[i]] = solution[static_cast<Eigen::Index>(i)];
  const Row torque = M * u - f;
  JointedAnswer answer;
  answer.acceleration = u.segment<3>(0);
  answer.angular_acceleration = u.segment<3>(3);
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t j = 0; j < 4; ++j) {
      answer.joint[side][j] = u[static_cast<Eigen::Index>(6 + 4 * side + j)];
      answer.torque[side][j] = torque[static_cast<Eigen::Index>(6 + 4 * side + j)];
    }
  return answer;
}

}  // namespace flappy::test
