// Blade-element quasi-steady aerodynamics of one wing (Fei et al., ICRA 2019, arXiv 1902.09628). E is the frame of the
// leading edge (y along the span, +y outward on the left, inward on the right); v and w are the velocity of the
// shoulder and the angular velocity of E, both in E, relative to the air; s = +1 left, -1 right. Seen from E the wing
// moves in-plane along -x and out of plane along z. At span r:
//   U_i = U_i1 r + U_i0      U_i1 = s w_z      U_i0 = -v_x
//   U_o = U_o1 r + U_o0      U_o1 = s w_x      U_o0 =  v_z
//   alpha = theta + sgn(U_i) pi/2 - atan(U_o/U_i), at r_cp
//   a2 = U_i1^2 + U_o1^2     a1 = 2 (U_i1 U_i0 + U_o1 U_o0)     a0 = U_i0^2 + U_o0^2
//   F_N    = 1/2 rho c C_N (a2 R^3 r22 + a1 R^2 r11 + a0 R r00)               along +x of the wing, at span r_cp
//   M_aero = -1/2 rho c^2 C_N d_cp (a2 R^3 z_cp2 + a1 R^2 z_cp1 + a0 R z_cp0)  about +y: F_N acts at -M_aero/F_N below
//   M_rd   = -1/8 rho |theta'| theta' C_rd R c^4 z_rd                          about +y
//   C_N  = 1.8 sin 2a cos a + 1.95 sin a - 1.5 cos 2a sin a = sin a (0.6 cos^2 a + 3.45)
//   d_cp = 0.46 - 0.332 cos a - 0.037 cos 3a - 0.013 cos 5a, even and 2 pi periodic
// U_i0 and U_o0 have the signs of the paper's code (Wing.cpp), opposite to its text, and of the geometry: translation
// along -x has the sign of a stroke that moves the wing along -x. With b = sgn(U_i) pi/2 - atan(U_o/U_i), (cos b, sin
// b) = (U_o, U_i)/|U| for both signs of U_i: alpha = theta + b needs no arc tangent. Assumes quasi-steady flow, Re
// about 1e4 and a rigid wing; src/model/effects has the unsteady effects.
#pragma once

#include "model/flapper.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// Squared air speed below which the flow has no direction, m^2/s^2.
inline constexpr double kStillAir_m2_s2 = 1e-12;

template <class T>
struct NormalForceCoefficients {
  T force;            // C_N
  T pressure_centre;  // d_cp, fraction of the chord behind the leading edge
};

template <class T>
FLAPPY_INLINE NormalForceCoefficients<T> coefficients(const T& sin_alpha, const T& cos_alpha) {
  const T c2 = cos_alpha * cos_alpha;
  return {sin_alpha * T(T(0.6) * c2 + T(3.45)),
          cos_alpha * T(T(T(T(-0.208) * c2 + T(0.112)) * c2) + T(-0.286)) + T(0.46)};
}

/// Aerodynamic wrench on a wing at its shoulder, in E, with its moments about the hinges.
template <class T>
struct WingWrench {
  T normal_force_N;        // F_N
  T force_x_N, force_z_N;  // the force along the span is 0
  Vec3<T> moment_Nm;       // y: about the rotation hinge; z: about the leading edge's z
};

/// Scales the lift: the force normal to the plane of the strokes, and its moment about the leading edge's x.
template <class T>
FLAPPY_INLINE WingWrench<T> with_lift(const WingWrench<T>& w, const T& factor) {
  return {w.normal_force_N, w.force_x_N, factor * w.force_z_N, {factor * w.moment_Nm.x, w.moment_Nm.y, w.moment_Nm.z}};
}

/// `v`, `w`: velocity of the shoulder and angular velocity of E relative to the air, in E. `side`: +1 left, -1 right.
template <int side, class T>
FLAPPY_INLINE WingWrench<T> blade_element(const SideParameters<T>& p, const SinCos<T>& theta, const T& theta_rate,
                                          const Vec3<T>& v, const Vec3<T>& w) {
  constexpr double s = side;
  const T ui1 = T(s) * w.z, ui0 = -v.x;
  const T uo1 = T(s) * w.x, uo0 = v.z;
  const T ui = ui1 * p.span_to_pressure_m + ui0;
  const T uo = uo1 * p.span_to_pressure_m + uo0;
  const T inverse_speed = T(1) / sqrt(T(ui * ui + (uo * uo + T(kStillAir_m2_s2))));
  const T sin_alpha = T(theta.sin * uo + theta.cos * ui) * inverse_speed;
  const T cos_alpha = T(theta.cos * uo - theta.sin * ui) * inverse_speed;
  const NormalForceCoefficients<T> c = coefficients(sin_alpha, cos_alpha);

  const T a2 = ui1 * ui1 + uo1 * uo1;
  const T half_a1 = ui1 * ui0 + uo1 * uo0;
  const T a0 = ui0 * ui0 + uo0 * uo0;
  const T normal = c.force * T(a2 * p.force2 + (half_a1 * p.force1 + a0 * p.force0));
  const T pressure = -(T(c.force * c.pressure_centre) * T(a2 * p.moment2 + (half_a1 * p.moment1 + a0 * p.moment0)));
  const T damping = -(T(p.rotational_damping_Nm_s2 * abs(theta_rate)) * theta_rate);

  // (F_N, 0, 0) at (0, s r_cp, -D) of the wing frame, turned by theta about y
  const T arm = T(-s) * p.span_to_pressure_m * normal;
  return {normal, theta.cos * normal, -(theta.sin * normal), {theta.sin * arm, pressure + damping, theta.cos * arm}};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
