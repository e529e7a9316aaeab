// One wing and its leading edge, hinged at a shoulder: pose, inertia seen from the vehicle, and the inertial forces of
// their motion relative to it. In the leading edge's frame L (B turned by beta about z), about the shoulder; h: first
// moment of mass, P: second moment (integral of r r^T; inertia J = tr P - P); index w: the wing, turned by theta about
// y; none: wing and edge. Body rate w; relative rates W_edge = (0, 0, b), W_wing = (0, t, b) with b = beta', t =
// theta'. If beta'' = theta'' = 0, the acceleration of a point relative to the frozen vehicle is
//   2 w x (W x r) + W x (W x r) + W' x r          W'_edge = 0,  W'_wing = (-b t, 0, 0)
// and its moments are
//   integral r x (2 w x (W x r)) = 2 (P w) x W    integral r x (W x (W x r)) = (P W) x W    J W'
// Exact; summed over the two bodies they give `relative_force` and `relative_moment`.
#pragma once

#include "model/flapper.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// Hinge rates of one side: psi', theta', and theta'^2, which within a step is a mean of squares.
template <class T>
struct HingeRates {
  T stroke_rad_s, rotation_rad_s, rotation2_rad2_s2;
};
template <class T>
FLAPPY_INLINE HingeRates<T> hinge_rates(const SideState<T>& q) {
  return {q.stroke_rate_rad_s, q.rotation_rate_rad_s, q.rotation_rate_rad_s * q.rotation_rate_rad_s};
}

template <class T>
struct WingPose {
  SinCos<T> beta, theta;
  T beta_rate, theta_rate, theta_rate2;
  Vec3<T> body_rate_L;
  Vec3<T> wing_moment_L, moment_L;  // h_w, h
  Vec3<T> moment, momentum;         // h, and the momentum of the relative motion, in B
};

/// Inertia of a wing with its leading edge, and inertial loads of its relative motion without hinge accelerations.
template <class T>
struct WingInertia {
  Sym3<T> second;                      // P, in B
  Vec3<T> rotation_column;             // d momentum / d theta', in B; d momentum / d beta' is (-h_y, h_x, 0)
  Vec3<T> stroke_spin, rotation_spin;  // d angular momentum about the shoulder / d beta', d theta', in B
  T stroke_inertia, rotation_inertia, cross_inertia;
  Vec3<T> relative_force_L, relative_moment_L;  // Coriolis and centripetal, without the frozen part
  T stroke_bias, rotation_bias;                 // hinge torques, with the frozen part about the shoulder
};

template <int side, class T>
FLAPPY_INLINE Vec3<T> moment_about_shoulder(const SideParameters<T>& p, const SideState<T>& q) {
  const SinCos<T> beta = sin_cos(T(T(side) * q.stroke_rad)), theta = sin_cos(q.rotation_rad);
  const Vec3<T>& h = p.wing_moment_kg_m;
  return rotate_z(beta.sin, beta.cos, p.edge_moment_kg_m + rotate_y(theta.sin, theta.cos, h));
}

template <int side, class T>
FLAPPY_INLINE WingPose<T> place_wing(const SideParameters<T>& p, const SideState<T>& q, const HingeRates<T>& rates,
                                     const Vec3<T>& body_rate) {
  WingPose<T> g;
  g.beta = sin_cos(T(T(side) * q.stroke_rad));
  g.theta = sin_cos(q.rotation_rad);
  const T b = g.beta_rate = T(side) * rates.stroke_rad_s;
  const T t = g.theta_rate = rates.rotation_rad_s;
  g.theta_rate2 = rates.rotation2_rad2_s2;
  const Vec3<T> hw = g.wing_moment_L = rotate_y(g.theta.sin, g.theta.cos, p.wing_moment_kg_m);
  const Vec3<T> h = g.moment_L = p.edge_moment_kg_m + hw;
  g.moment = rotate_z(g.beta.sin, g.beta.cos, h);
  g.momentum = rotate_z(g.beta.sin, g.beta.cos, Vec3<T>{t * hw.z - b * h.y, b * h.x, -(t * hw.x)});
  g.body_rate_L = rotate_back_z(g.beta.sin, g.beta.cos, body_rate);
  return g;
}

template <int side, class T>
FLAPPY_INLINE WingPose<T> place_wing(const SideParameters<T>& p, const SideState<T>& q, const Vec3<T>& body_rate) {
  return place_wing<side>(p, q, hinge_rates(q), body_rate);
}

template <class T>
FLAPPY_INLINE WingInertia<T> wing_inertia(const SideParameters<T>& p, const WingPose<T>& g) {
  WingInertia<T> i;
  const Vec3<T>&w = g.body_rate_L, &h = g.moment_L, &hw = g.wing_moment_L;
  const T &b = g.beta_rate, &t = g.theta_rate;
  const Sym3<T> pw = rotate_y(g.theta.sin, g.theta.cos, p.wing_second_kg_m2);
  const Sym3<T> P = p.edge_second_kg_m2 + pw;
  i.second = rotate_z(g.beta.sin, g.beta.cos, P);
  i.stroke_inertia = P.xx + P.yy;
  i.rotation_inertia = pw.xx + pw.zz;
  i.cross_inertia = -pw.yz;
  i.rotation_column = rotate_z(g.beta.sin, g.beta.cos, hw.z, T(-hw.x));
  i.stroke_spin = {-i.second.xz, -i.second.yz, i.stroke_inertia};
  i.rotation_spin = rotate_z(g.beta.sin, g.beta.cos, Vec3<T>{-pw.xy, i.rotation_inertia, -pw.yz});

  const T Pw_x = P.xx * w.x + (P.xy * w.y + P.xz * w.z), Pw_y = P.xy * w.x + (P.yy * w.y + P.yz * w.z);
  const T pw_x = pw.xx * w.x + (pw.xy * w.y + pw.xz * w.z), pw_z = pw.xz * w.x + (pw.yz * w.y + pw.zz * w.z);
  const T m_x = (Pw_x + Pw_x) + (b * P.xz + t * pw.xy), m_y = (Pw_y + Pw_y) + (b * P.yz + t * pw.yy);
  const T k_x = (pw_x + pw_x) + b * pw.xz, k_z = (pw_z + pw_z) + b * pw.zz;  // without t^2
  const T bt = b * t, t2 = g.theta_rate2;
  const T wing_y = bt * pw.xy - (k_x + t * pw.xy) * b;
  i.relative_moment_L = {m_y * b - ((k_z * t + t2 * pw.yz) + bt * T(pw.yy + pw.zz)), bt * pw.xy - m_x * b,
                         (k_x * t + t2 * pw.xy) + bt * pw.xz};
  const Vec3<T> twice{w.x + w.x, w.y + w.y, w.z + w.z + b};
  const Vec3<T> momentum_L{t * hw.z - b * h.y, b * h.x, -(t * hw.x)};
  i.relative_force_L = cross(twice, momentum_L) + Vec3<T>{-(t2 * hw.x), bt * hw.z, -(t2 * hw.z)};
  i.stroke_bias = i.relative_moment_L.z + T(Pw_x * w.y - Pw_y * w.x);
  i.rotation_bias = wing_y + T(pw_z * w.x - pw_x * w.z);
  return i;
}

/// Angular momentum of a wing and its leading edge, about the origin of a torso at rest, in B.
template <class T>
FLAPPY_INLINE Vec3<T> angular_momentum(const WingPose<T>& g, const WingInertia<T>& i, const Vec3<T>& shoulder) {
  return g.beta_rate * i.stroke_spin + g.theta_rate * i.rotation_spin + cross(shoulder, g.momentum);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
