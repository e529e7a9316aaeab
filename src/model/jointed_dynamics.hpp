// Exact dynamics of a torso with articulated wings: two sides of four angles, any of which may be fixed, driven or
// free.
//
// Coordinates. The leading edge of a side has the frame E, from B by R_y(-Phi) R_z(s psi) R_x(s phi); its wing is
// R_y(theta) from E, all about the shoulder at r_s: as published (Fei et al. 2019), except the sign of Phi on the
// right, so that a mirrored vehicle has the same numbers. With the axes e_j of the four angles and w_0 the body rate,
//   w_j = w_(j-1) + e_j q_j'        a_j = a_(j-1) + e_j q_j'' + w_(j-1) x e_j q_j'         E: j = 3, wing: j = 4
// Newton and Euler about the shoulder, with h the first and P the second moment of mass of a body, A the acceleration
// of the shoulder less gravity:
//   force = m A + a x h + w x (w x h)            moment = h x A + (tr P - P) a - w x (P w)
// The air that the wing carries adds Sym3 K on (v_x' , w_y', w_z') in the wing's axes (strip_aerodynamics.hpp), without
// gravity.
//
// Unknowns. Accelerations a_0 of the torso's origin and w_0' (both in B), and q'' of the free angles only. The terms
// that are linear in them form a symmetric mass matrix; all other terms, including the prescribed q'' of driven angles,
// form the right-hand side, so the body feels the reaction of the gait (Kane's method [1] in the form of the composite
// body [2]). The matrix is factored as L D L^T without pivoting, which a positive definite matrix does not need. Then
// inverse dynamics, the same equations with all accelerations known, give the torque about every axis. The torque of a
// driven axis, less that of a parallel spring and damper, is the muscle's; its power is that torque times q'.
//
// In a step h, angles lead rates by h/2 (sim/jointed_step.cpp). Springs and stops of free angles act at q + h^2/4 q'',
// the weighted mean of the angles of three steps, dampers at the mean of old and new rate: of second order, and stable
// for any stiffness (Newmark's method [3] with beta = 1/4). Both add to the mass matrix.
// [1] Kane, Levinson, Dynamics: Theory and Applications, 1985. [2] Featherstone, Rigid Body Dynamics Algorithms, 2008.
// [3] Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85, 1959.
// Assumes rigid bodies, and muscles that follow the gait with whatever torque it needs.
#pragma once

#include "model/gait.hpp"
#include "model/linear_algebra.hpp"
#include "model/vehicle_dynamics.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

inline constexpr int kJoints = 4;
enum JointAxis : int { kPlane, kStroke, kDeviation, kRotation };

template <class T>
struct JointParameters {
  T mean_rad, stiffness_Nm_rad, rest_rad, damping_Nm_s;
  T lower_rad, upper_rad, stop_stiffness_Nm_rad, stop_damping_Nm_s;
};

template <class T>
struct JointedSide {
  Vec3<T> shoulder_m;        // in B
  T mass_kg;                 // leading edge and wing
  Vec3<T> edge_moment_kg_m;  // first and second moment about the shoulder, in E
  Sym3<T> edge_second_kg_m2;
  Vec3<T> wing_moment_kg_m;  // in the wing's frame
  Sym3<T> wing_second_kg_m2;
  Sym3<T> added;  // K: kg, kg m^2, kg m^2, kg m, kg m^2, kg m
  T rotational_damping_Nm_s2;
  T pitching_force_N_s2, pitching_force_moment_Nm_s2;  // strips: force of that damping, and its moment about z
  JointParameters<T> joints[kJoints];
};

template <class T>
struct JointedParameters {
  T torso_kg;
  Vec3<T> torso_moment_kg_m;
  Sym3<T> torso_second_kg_m2;  // about the origin
  T frequency_Hz;
  JointedSide<T> left, right;
};

/// Pose and motion of a side, and its accelerations while all unknowns are 0; in E.
template <class T>
struct JointedPose {
  SinCos<T> plane, beta, lift, theta;
  Vec3<T> axis[kJoints];
  Vec3<T> edge_rate, wing_rate;                  // relative to inertial space
  Vec3<T> edge_acceleration, wing_acceleration;  // without w' and the q'' of free angles
  Vec3<T> wing_moment;                           // first moment of the wing
  Sym3<T> wing_second;
  T rate[kJoints];

  FLAPPY_INLINE Vec3<T> to_B(const Vec3<T>& v) const {
    return rotate_y(plane.sin, plane.cos, rotate_z(beta.sin, beta.cos, rotate_x(lift.sin, lift.cos, v)));
  }
  FLAPPY_INLINE Sym3<T> to_B(const Sym3<T>& p) const {
    return rotate_y(plane.sin, plane.cos, rotate_z(beta.sin, beta.cos, rotate_x(lift.sin, lift.cos, p)));
  }
  FLAPPY_INLINE Vec3<T> to_E(const Vec3<T>& v) const {
    return rotate_back_x(lift.sin, lift.cos, rotate_back_z(beta.sin, beta.cos, rotate_back_y(plane.sin, plane.cos, v)));
  }
  FLAPPY_INLINE Vec3<T> to_wing(const Vec3<T>& v_E) const { return rotate_back_y(theta.sin, theta.cos, v_E); }
  FLAPPY_INLINE Vec3<T> from_wing(const Vec3<T>& v) const { return rotate_y(theta.sin, theta.cos, v); }
};

/// `q`: the four angles; the accelerations of free ones are 0.
template <int side, class T>
FLAPPY_INLINE JointedPose<T> place_side(const JointedSide<T>& p, const Moving<T> (&q)[kJoints],
                                        const Vec3<T>& body_rate) {
  const T s(side), zero(0), one(1);
  JointedPose<T> g;
  g.plane = sin_cos(T(-q[kPlane].value));
  g.beta = sin_cos(T(s * q[kStroke].value));
  g.lift = sin_cos(T(s * q[kDeviation].value));
  g.theta = sin_cos(q[kRotation].value);
  g.axis[kPlane] = T(-1) * rotate_back_x(g.lift.sin, g.lift.cos, Vec3<T>{g.beta.sin, g.beta.cos, zero});
  g.axis[kStroke] = {zero, s * g.lift.sin, s * g.lift.cos};
  g.axis[kDeviation] = {s, zero, zero};
  g.axis[kRotation] = {zero, one, zero};
  Vec3<T> w = g.to_E(body_rate), a{zero, zero, zero};
  for (int j = 0; j < kJoints; ++j) {
    if (j == kRotation) g.edge_rate = w, g.edge_acceleration = a;
    g.rate[j] = q[j].rate;
    const Vec3<T> turn = q[j].rate * g.axis[j];
    a = add_scaled(a + cross(w, turn), q[j].acceleration, g.axis[j]);
    w = w + turn;
  }
  g.wing_rate = w, g.wing_acceleration = a;
  g.wing_moment = g.from_wing(p.wing_moment_kg_m);
  g.wing_second = rotate_y(g.theta.sin, g.theta.cos, p.wing_second_kg_m2);
  return g;
}

template <class T>
FLAPPY_INLINE Vec3<T> inertia_times(const Sym3<T>& second, const Vec3<T>& a) {
  const T trace = T(second.xx + second.yy) + second.zz;
  return trace * a - second * a;
}

template <class T>
struct SideWrench {
  Vec3<T> force, edge_moment, wing_moment;
};

/// `felt`: acceleration of the shoulder less gravity; `moves`: including gravity; `air_speed`: velocity of the shoulder
/// in the air; all in E.
template <class T>
FLAPPY_INLINE SideWrench<T> inertial_wrench(const JointedSide<T>& p, const JointedPose<T>& g, const Vec3<T>& felt,
                                            const Vec3<T>& moves, const Vec3<T>& air_speed,
                                            const Vec3<T>& edge_acceleration, const Vec3<T>& wing_acceleration,
                                            bool carries_air) {
  const auto swung = [](const Vec3<T>& w, const Vec3<T>& a, const Vec3<T>& h) {
    return cross(a, h) + cross(w, cross(w, h));
  };
  const auto turned = [&](const Vec3<T>& w, const Vec3<T>& a, const Vec3<T>& h, const Sym3<T>& P) {
    return (cross(h, felt) + inertia_times(P, a)) - cross(w, P * w);
  };
  SideWrench<T> f;
  f.force = p.mass_kg * felt + (swung(g.edge_rate, edge_acceleration, p.edge_moment_kg_m) +
                                swung(g.wing_rate, wing_acceleration, g.wing_moment));
  f.edge_moment = turned(g.edge_rate, edge_acceleration, p.edge_moment_kg_m, p.edge_second_kg_m2);
  f.wing_moment = turned(g.wing_rate, wing_acceleration, g.wing_moment, g.wing_second);
  if (!carries_air) return f;
  const Vec3<T> w = g.to_wing(g.wing_rate), a = g.to_wing(wing_acceleration), v = g.to_wing(air_speed);
  const T forward = g.to_wing(moves).x - T(w.y * v.z - w.z * v.y);
  const Vec3<T> taken = p.added * Vec3<T>{forward, a.y, a.z};
  const T zero(0);
  f.force = f.force + g.from_wing({taken.x, zero, zero});
  f.wing_moment = f.wing_moment + g.from_wing({zero, taken.y, taken.z});
  return f;
}

/// A symmetric system of up to 14 unknowns: a_0, w_0', then free angles.
inline constexpr int kBodyUnknowns = 6, kMaxUnknowns = kBodyUnknowns + 2 * kJoints;

template <class T>
struct JointedSystem {
  T matrix[kMaxUnknowns][kMaxUnknowns];  // lower triangle
  T right[kMaxUnknowns];
};

/// Solves in place: `right` becomes the unknowns. `fixed`: the size if it is known at compile time, else 0.
template <int fixed, class T>
FLAPPY_INLINE void solve(JointedSystem<T>& s, int any_size) {
  const int size = fixed > 0 ? fixed : any_size;
  T inverse[kMaxUnknowns];
#pragma GCC unroll 6
  for (int j = 0; j < size; ++j) {
    T scaled[kMaxUnknowns];  // row j of L D
    T d = s.matrix[j][j], x = s.right[j];
#pragma GCC unroll 6
    for (int k = 0; k < j; ++k) {
      scaled[k] = s.matrix[j][k];
      s.matrix[j][k] = scaled[k] * inverse[k];
      d -= scaled[k] * s.matrix[j][k];
      x -= s.matrix[j][k] * s.right[k];
    }
    inverse[j] = T(1) / d;
    s.right[j] = x;
#pragma GCC unroll 6
    for (int i = j + 1; i < size; ++i) {
      T below = s.matrix[i][j];
#pragma GCC unroll 6
      for (int k = 0; k < j; ++k) below -= s.matrix[i][k] * s.matrix[j][k];
      s.matrix[i][j] = below;
    }
  }
#pragma GCC unroll 6
  for (int j = size - 1; j >= 0; --j) {
    T x = s.right[j] * inverse[j];
#pragma GCC unroll 6
    for (int i = j + 1; i < size; ++i) x -= s.matrix[i][j] * s.right[i];
    s.right[j] = x;
  }
}

/// Index of the unknown of each angle of a side; -1: the angle is not free.
struct FreeJoints {
  int unknown[kJoints] = {-1, -1, -1, -1};
  bool operator==(const FreeJoints&) const = default;
};

/// Starts the right-hand side with the torso: gravity and its inertial loads. Clears the rows of free angles.
template <class T>
FLAPPY_INLINE void begin_system(const JointedParameters<T>& p, const Vec3<T>& w, const Vec3<T>& gravity_B, int size,
                                JointedSystem<T>& s) {
  const T zero(0);
  for (int i = kBodyUnknowns; i < size; ++i)
    for (int k = 0; k <= i; ++k) s.matrix[i][k] = zero;
  const Vec3<T>& h = p.torso_moment_kg_m;
  const Vec3<T> force = p.torso_kg * gravity_B - cross(w, cross(w, h));
  const Vec3<T> moment = cross(h, gravity_B) + cross(w, p.torso_second_kg_m2 * w);
  s.right[0] = force.x, s.right[1] = force.y, s.right[2] = force.z;
  s.right[3] = moment.x, s.right[4] = moment.y, s.right[5] = moment.z;
  for (int i = kBodyUnknowns; i < size; ++i) s.right[i] = zero;
}

/// Writes the rigid part of the body's block: first moment h and second moment P of the whole vehicle about the origin.
template <class T>
FLAPPY_INLINE void put_body(const T& mass, const Vec3<T>& h, const Sym3<T>& P, JointedSystem<T>& s) {
  const T zero(0);
  auto& m = s.matrix;
  m[0][0] = m[1][1] = m[2][2] = mass;
  m[1][0] = m[2][0] = m[2][1] = zero;
  // force of w' x h in the columns of w', as rows of the lower triangle: h x a_0 in the moments
  m[3][0] = zero, m[3][1] = -h.z, m[3][2] = h.y;
  m[4][0] = h.z, m[4][1] = zero, m[4][2] = -h.x;
  m[5][0] = -h.y, m[5][1] = h.x, m[5][2] = zero;
  const Sym3<T> J = inertia_of(P);
  m[3][3] = J.xx, m[4][4] = J.yy, m[5][5] = J.zz;
  m[4][3] = J.xy, m[5][3] = J.xz, m[5][4] = J.yz;
}

/// Adds the inertia of the air that a wing carries to the body's block.
template <class T>
FLAPPY_INLINE void add_carried_air(const JointedSide<T>& p, const JointedPose<T>& g, JointedSystem<T>& s) {
  const T zero(0), one(1);
  const Vec3<T> x = g.to_B(g.from_wing({one, zero, zero})), y = g.to_B(Vec3<T>{zero, one, zero}),
                z = g.to_B(g.from_wing({zero, zero, one})), about = cross(p.shoulder_m, x);
  const T rows[3][kBodyUnknowns] = {
      {x.x, x.y, x.z, about.x, about.y, about.z}, {zero, zero, zero, y.x, y.y, y.z}, {zero, zero, zero, z.x, z.y, z.z}};
  for (int i = 0; i < kBodyUnknowns; ++i) {
    const Vec3<T> carried = p.added * Vec3<T>{rows[0][i], rows[1][i], rows[2][i]};
    for (int k = 0; k <= i; ++k)
      s.matrix[i][k] += T(carried.x * rows[0][k] + T(carried.y * rows[1][k] + carried.z * rows[2][k]));
  }
}

/// Force and moments for a unit acceleration of an angle, at the shoulder in E: of the whole side, and of its wing.
template <class T>
struct JointColumn {
  Vec3<T> force, moment, wing_moment;
};

template <class T>
FLAPPY_INLINE JointColumn<T> joint_column(const JointedSide<T>& p, const JointedPose<T>& g, int joint,
                                          bool carries_air) {
  const Vec3<T>& e = g.axis[joint];
  JointColumn<T> c;
  c.force = cross(e, g.wing_moment);
  c.wing_moment = inertia_times(g.wing_second, e);
  if (carries_air) {
    const T zero(0);
    const Vec3<T> turn = g.to_wing(e), taken = p.added * Vec3<T>{zero, turn.y, turn.z};
    c.force = c.force + g.from_wing({taken.x, zero, zero});
    c.wing_moment = c.wing_moment + g.from_wing({zero, taken.y, taken.z});
  }
  c.moment = c.wing_moment;
  if (joint == kRotation) return c;
  c.force = c.force + cross(e, p.edge_moment_kg_m);
  c.moment = c.moment + inertia_times(p.edge_second_kg_m2, e);
  return c;
}

template <class T>
struct JointPull {
  T torque_Nm, inertia_kg_m2;
};

/// `angle`: in the middle of the step; `rate`: at its start.
template <class T>
FLAPPY_INLINE JointPull<T> pull_of(const JointParameters<T>& j, const T& angle, const T& rate, const T& step) {
  const T beyond_upper = max(T(angle - j.upper_rad), T(0)), beyond_lower = min(T(angle - j.lower_rad), T(0));
  const T beyond = beyond_upper + beyond_lower, zero(0);
  const auto free = beyond == zero;
  const T stop = where(free, zero, j.stop_stiffness_Nm_rad), brake = where(free, zero, j.stop_damping_Nm_s);
  const T half = T(0.5) * step, damping = j.damping_Nm_s + brake;
  return {-(T(j.stiffness_Nm_rad * T(angle - j.rest_rad)) + T(stop * beyond + damping * rate)),
          half * T(damping + half * T(j.stiffness_Nm_rad + stop))};
}

/// Adds one side: inertia, loads of its motion, and `force`, `moment` of the air at the shoulder in E. `pulls`: of free
/// angles.
template <class T>
FLAPPY_INLINE void add_side(const JointedSide<T>& p, const JointedPose<T>& g, const SideWrench<T>& taken,
                            const Vec3<T>& force, const Vec3<T>& moment, const JointPull<T> (&pulls)[kJoints],
                            const FreeJoints& free, bool carries_air, JointedSystem<T>& s) {
  const Vec3<T> net_force = g.to_B(force - taken.force);
  const Vec3<T> wing = moment - taken.wing_moment, net = wing - taken.edge_moment;
  const Vec3<T> net_moment = g.to_B(net) + cross(p.shoulder_m, net_force);
  s.right[0] += net_force.x, s.right[1] += net_force.y, s.right[2] += net_force.z;
  s.right[3] += net_moment.x, s.right[4] += net_moment.y, s.right[5] += net_moment.z;
  JointColumn<T> columns[kJoints];
  for (int j = 0; j < kJoints; ++j) {
    const int row = free.unknown[j];
    if (row < 0) continue;
    columns[j] = joint_column(p, g, j, carries_air);
    const Vec3<T> F = g.to_B(columns[j].force), N = g.to_B(columns[j].moment) + cross(p.shoulder_m, F);
    s.matrix[row][0] = F.x, s.matrix[row][1] = F.y, s.matrix[row][2] = F.z;
    s.matrix[row][3] = N.x, s.matrix[row][4] = N.y, s.matrix[row][5] = N.z;
    for (int k = 0; k <= j; ++k) {  // the axis of k turns what j moves: the wing alone where j is its rotation
      const int column = free.unknown[k];
      if (column >= 0) s.matrix[row][column] = dot(g.axis[k], columns[j].moment);
    }
    s.matrix[row][row] += pulls[j].inertia_kg_m2;
    s.right[row] += dot(g.axis[j], j == kRotation ? wing : net) + pulls[j].torque_Nm;
  }
}

/// Loads on one side: air at the shoulder in E, the shoulder's velocity in the air in E, pulls of free angles.
template <class T>
struct JointedLoad {
  Vec3<T> force_N, moment_Nm, air_speed_m_s;
  JointPull<T> pulls[kJoints];
};

/// Accelerations and torques of a vehicle at one instant.
template <class T>
struct JointedMotion {
  Vec3<T> acceleration_m_s2, angular_acceleration_rad_s2;  // of the origin; in B
  Sides<T[kJoints]> joint_rad_s2;                          // as prescribed, or solved for
  Sides<T[kJoints]> torque_Nm;                             // about each axis: the torque that this motion requires
};

/// `held`: lanes whose torso does not move. `carries_air`: whether any wing has added mass.
template <class T, class Held>
FLAPPY_INLINE JointedMotion<T> accelerate(const JointedParameters<T>& p, const Sides<JointedPose<T>>& pose,
                                          const Sides<Moving<T>[kJoints]>& q, const Sides<JointedLoad<T>>& load,
                                          const Vec3<T>& w, const Vec3<T>& gravity_B, const FreeJoints (&free)[2],
                                          int size, bool carries_air, const Held& held) {
  JointedSystem<T> s;
  begin_system(p, w, gravity_B, size, s);
  const auto at_shoulder = [&](const JointedSide<T>& side) { return cross(w, cross(w, side.shoulder_m)); };
  const auto side = [&](const JointedSide<T>& own, const JointedPose<T>& g, const JointedLoad<T>& acts,
                        const FreeJoints& joints) {
    const Vec3<T> moves = g.to_E(at_shoulder(own)), felt = g.to_E(at_shoulder(own) - gravity_B);
    const SideWrench<T> taken =
        inertial_wrench(own, g, felt, moves, acts.air_speed_m_s, g.edge_acceleration, g.wing_acceleration, carries_air);
    add_side(own, g, taken, acts.force_N, acts.moment_Nm, acts.pulls, joints, carries_air, s);
  };
  side(p.left, pose.left, load.left, free[0]);
  side(p.right, pose.right, load.right, free[1]);
  const Vec3<T> h_left = pose.left.to_B(p.left.edge_moment_kg_m + pose.left.wing_moment),
                h_right = pose.right.to_B(p.right.edge_moment_kg_m + pose.right.wing_moment);
  const auto second = [](const JointedSide<T>& own, const JointedPose<T>& g, const Vec3<T>& h) {
    return g.to_B(own.edge_second_kg_m2 + g.wing_second) +
           hung_at(own.shoulder_m, add_scaled(h, T(T(0.5) * own.mass_kg), own.shoulder_m));
  };
  put_body(T(p.torso_kg + T(p.left.mass_kg + p.right.mass_kg)),
           p.torso_moment_kg_m + (add_scaled(h_left, p.left.mass_kg, p.left.shoulder_m) +
                                  add_scaled(h_right, p.right.mass_kg, p.right.shoulder_m)),
           p.torso_second_kg_m2 + (second(p.left, pose.left, h_left) + second(p.right, pose.right, h_right)), s);
  if (carries_air) {
    add_carried_air(p.left, pose.left, s);
    add_carried_air(p.right, pose.right, s);
  }
  if (rarely(held)) {
    const T zero(0), one(1);
    for (int i = 0; i < size; ++i) {
      for (int k = 0; k < kBodyUnknowns && k < i; ++k) s.matrix[i][k] = where(held, zero, s.matrix[i][k]);
      if (i >= kBodyUnknowns) continue;
      s.matrix[i][i] = where(held, one, s.matrix[i][i]);
      s.right[i] = where(held, zero, s.right[i]);
    }
  }
  if (size == kBodyUnknowns) solve<kBodyUnknowns>(s, size);
  else solve<0>(s, size);

  JointedMotion<T> m;
  m.acceleration_m_s2 = {s.right[0], s.right[1], s.right[2]};
  m.angular_acceleration_rad_s2 = {s.right[3], s.right[4], s.right[5]};
  const auto found = [&](const JointedSide<T>& own, const JointedPose<T>& g, const Moving<T>(&angles)[kJoints],
                         const JointedLoad<T>& acts, const FreeJoints& joints, T(&joint_rad_s2)[kJoints],
                         T(&torque_Nm)[kJoints]) {
    const Vec3<T> turn = g.to_E(m.angular_acceleration_rad_s2);
    Vec3<T> edge = g.edge_acceleration + turn, wing = g.wing_acceleration + turn;
    for (int j = 0; j < kJoints; ++j) {
      const int row = joints.unknown[j];
      joint_rad_s2[j] = row < 0 ? angles[j].acceleration : s.right[row];
      if (row < 0) continue;
      if (j != kRotation) edge = add_scaled(edge, s.right[row], g.axis[j]);
      wing = add_scaled(wing, s.right[row], g.axis[j]);
    }
    const Vec3<T> shoulder =
        m.acceleration_m_s2 + cross(m.angular_acceleration_rad_s2, own.shoulder_m) + at_shoulder(own);
    const SideWrench<T> taken = inertial_wrench(own, g, g.to_E(shoulder - gravity_B), g.to_E(shoulder),
                                                acts.air_speed_m_s, edge, wing, carries_air);
    const Vec3<T> of_wing = taken.wing_moment - acts.moment_Nm, all = of_wing + taken.edge_moment;
    for (int j = 0; j < kJoints; ++j) torque_Nm[j] = dot(g.axis[j], j == kRotation ? of_wing : all);
  };
  found(p.left, pose.left, q.left, load.left, free[0], m.joint_rad_s2.left, m.torque_Nm.left);
  found(p.right, pose.right, q.right, load.right, free[1], m.joint_rad_s2.right, m.torque_Nm.right);
  return m;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
