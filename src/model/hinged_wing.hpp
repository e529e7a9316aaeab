// One wing and its leading edge, hinged at a shoulder: their inertia seen from the vehicle, and the inertial
// forces of their motion relative to it.
//
// All in the leading edge's frame L (B turned by beta about z), about the shoulder. h: first moment of mass,
// P: second moment (integral of r r^T; inertia J = tr P - P); index w: wing, turned by theta about y; none:
// wing and edge. With body rate w = (a, b, c), relative rates W_edge = (0, 0, B), W_wing = (0, T, B), B =
// beta', T = theta':
//   relative acceleration of a point: 2 w x (W x r) + W x (W x r) + W' x r,  W'_wing = (-B T, 0, 0) at zero
//   beta'', theta'' integral r x (2 w x (W x r)) = 2 (P w) x W      integral r x (W x (W x r)) = (P W) x W
// Both are exact; summed over the two bodies they give `relative_force` and `relative_moment`.
#pragma once

#include "model/flapper.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct HingedWing {
  SinCos<T> beta, theta;
  T beta_rate, theta_rate;
  Vec3<T> body_rate_L;
  // relative to B, in B
  Vec3<T> moment;                      // h
  Sym3<T> second;                      // P
  Vec3<T> momentum;                    // of the relative motion
  Vec3<T> rotation_column;             // d momentum / d theta'; that of beta' is (-h_y, h_x, 0)
  Vec3<T> stroke_spin, rotation_spin;  // d angular momentum about the shoulder / d beta', d theta'
  T stroke_inertia, rotation_inertia, cross_inertia;
  // bias: what inertia asks of the hinges at zero acceleration
  Vec3<T> relative_force_L, relative_moment_L;  // Coriolis and centripetal, without the frozen part
  T stroke_bias, rotation_bias;                 // hinge torques, with the frozen part about the shoulder
};

/// First moment of a wing and its leading edge about the shoulder, in B: what the centre of mass needs.
template <int side, class T>
FLAPPY_INLINE Vec3<T> moment_about_shoulder(const SideParameters<T>& p, const SideState<T>& q) {
  const SinCos<T> beta = sin_cos(T(T(side) * q.stroke_rad)), theta = sin_cos(q.rotation_rad);
  const Vec3<T>& h = p.wing_moment_kg_m;
  return turn_z(beta.sin, beta.cos, p.edge_moment_kg_m + turn_y(theta.sin, theta.cos, h));
}

template <int side, class T>
FLAPPY_INLINE HingedWing<T> place_wing(const SideParameters<T>& p, const SideState<T>& q,
                                       const Vec3<T>& body_rate) {
  HingedWing<T> g;
  g.beta = sin_cos(T(T(side) * q.stroke_rad));
  g.theta = sin_cos(q.rotation_rad);
  const T B = g.beta_rate = T(side) * q.stroke_rate_rad_s;
  const T W = g.theta_rate = q.rotation_rate_rad_s;

  const Vec3<T> hw = turn_y(g.theta.sin, g.theta.cos, p.wing_moment_kg_m);
  const Sym3<T> pw = turn_y(g.theta.sin, g.theta.cos, p.wing_second_kg_m2);
  const Vec3<T> h = p.edge_moment_kg_m + hw;
  const Sym3<T> P = p.edge_second_kg_m2 + pw;

  const auto to_body = [&](const Vec3<T>& v) { return turn_z(g.beta.sin, g.beta.cos, v); };
  g.moment = to_body(h);
  g.second = turn_z(g.beta.sin, g.beta.cos, P);
  g.rotation_column = turn_z(g.beta.sin, g.beta.cos, hw.z, T(-hw.x));
  g.stroke_inertia = P.xx + P.yy;
  g.stroke_spin = {-g.second.xz, -g.second.yz, g.stroke_inertia};
  g.rotation_spin = to_body({-pw.xy, pw.xx + pw.zz, -pw.yz});
  g.rotation_inertia = pw.xx + pw.zz;
  g.cross_inertia = -pw.yz;

  const Vec3<T> w = g.body_rate_L = turn_back_z(g.beta.sin, g.beta.cos, body_rate);
  const T Pw_x = P.xx * w.x + (P.xy * w.y + P.xz * w.z), Pw_y = P.xy * w.x + (P.yy * w.y + P.yz * w.z);
  const T pw_x = pw.xx * w.x + (pw.xy * w.y + pw.xz * w.z), pw_z = pw.xz * w.x + (pw.yz * w.y + pw.zz * w.z);
  const T m_x = (Pw_x + Pw_x) + (B * P.xz + W * pw.xy), m_y = (Pw_y + Pw_y) + (B * P.yz + W * pw.yy);
  const T k_x = (pw_x + pw_x) + (B * pw.xz + W * pw.xy), k_z = (pw_z + pw_z) + (B * pw.zz + W * pw.yz);
  const T BW = B * W, W2 = W * W;
  const T wing_y = BW * pw.xy - k_x * B;
  g.relative_moment_L = {m_y * B - (k_z * W + BW * T(pw.yy + pw.zz)), BW * pw.xy - m_x * B,
                         k_x * W + BW * pw.xz};

  const Vec3<T> twice{w.x + w.x, w.y + w.y, w.z + w.z + B};
  const Vec3<T> momentum_L{W * hw.z - B * h.y, B * h.x, -(W * hw.x)};
  g.momentum = to_body(momentum_L);
  g.relative_force_L = cross(twice, momentum_L) + Vec3<T>{-(W2 * hw.x), BW * hw.z, -(W2 * hw.z)};

  g.stroke_bias = g.relative_moment_L.z + T(Pw_x * w.y - Pw_y * w.x);
  g.rotation_bias = wing_y + T(pw_z * w.x - pw_x * w.z);
  return g;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
