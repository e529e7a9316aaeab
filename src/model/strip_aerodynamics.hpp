// Quasi-steady aerodynamics of a wing by strips along its span, in the wing's own axes: x its normal, y along the span,
// z towards the leading edge. v: velocity of the shoulder, w: angular velocity of the wing, both relative to the air. A
// strip of width dr at y (s times the distance from the shoulder), chord c, leading edge l above the axis of rotation,
// moves at its quarter chord with
//   v_n = v_x - w_z y + w_y (l - c/4) (normal)   v_c = v_z + w_x y (chordwise)   U^2 = v_n^2 + v_c^2
//   sin a = -v_n/U, cos a = v_c/U
//   dN  = 1/2 rho c dr C_N(a) U^2              along x, at d_cp(a) c behind the leading edge [1]
//   dT  = 1/2 rho c dr C_T(a) U^2              along -z
//   dR  = factor rho c^2 dr C_R v_c w_y        along x, at mid-chord, C_R = pi/2 [2]
//   dM  = -1/8 rho C_rd |w_y| w_y ((c - l)|c - l|^3 + l|l|^3) dr     about y [1]; dM, dD: drag of a plate that turns
//   dD  = 1/6 rho C_rd |w_y| w_y (|c - l|^3 - |l|^3) dr              along x         about y, integrated over its chord
// C_N = sin a P(cos a), C_T = Q(cos a): sums of sin(k a) and of cos(k a), as Chebyshev polynomials of cos a. Stroke,
// deviation and body contribute to w_y, not theta' alone. The circulation's force is proportional to v_c, not to U, and
// normal to the plate: it changes sign with the flow. Thin-aerofoil theory makes the flow tangent at 3/4 chord, which a
// turn about the quarter chord, where the bound vortex is and v_n is taken, moves at c/2 w_y. [2] has pi (3/4 - x_0)
// because it takes the flow at the axis, at x_0 of the chord; the sum is the same. So the axis enters the force only
// through the motion of the wing. Added mass [2, 3], rho pi/4 c^2 dr at mid-chord z = l - c/2 and rho pi/128 c^4 dr
// about it, causes a force and moments linear in (v_n)' = a_x + z w_y' - y w_z' and w_y', ' the rate of components in
// the wing's axes: a symmetric matrix on (v_x', w_y', w_z') in the vehicle's mass matrix (jointed_dynamics.hpp). Like
// [2], without Kirchhoff's terms w x momentum: separated flow has no leading-edge suction.
//
// Assumes that flow along the span has no influence, a rigid flat wing, no wake; valid for |w_y| c/U below about 1, and
// for C_N, C_T at the Reynolds number of their measurement.
// [1] Fei et al., ICRA 2019, arXiv 1902.09628. [2] Sane, Dickinson, J. Exp. Biol. 205, 2002. [3] Sedov 1965, cited in
// [2].
#pragma once

#include "model/jointed_dynamics.hpp"
#include "model/wing_aerodynamics.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct Strip {
  T y_m;
  T pressure_kg_m;   // 1/2 rho c dr
  T circulation_kg;  // factor rho c^2 dr C_R
  T chord_m;
  T leading_edge_m;
};

/// Coefficients of the polynomials P and Q, lowest power first.
template <class T>
struct SeriesOfForce {
  T normal[4], tangential[5];
};

/// Force and moment at the shoulder, in the wing's axes.
template <class T>
struct WingLoad {
  Vec3<T> force_N, moment_Nm;
};

template <class T>
FLAPPY_INLINE WingLoad<T> no_load() {
  const T zero(0);
  return {{zero, zero, zero}, {zero, zero, zero}};
}

/// Adds a strip to `load`; `slides`: whether the wing has a C_T.
template <class T>
FLAPPY_INLINE void add_strip(const Strip<T>& strip, const SeriesOfForce<T>& series, bool slides, const Vec3<T>& v,
                             const Vec3<T>& w, WingLoad<T>& load) {
  const T ahead = strip.leading_edge_m - T(0.25) * strip.chord_m;
  const T normal = T(v.x - w.z * strip.y_m) + w.y * ahead, chordwise = v.z + w.x * strip.y_m;
  const T speed2 = T(normal * normal + chordwise * chordwise) + T(kStillAir_m2_s2);
  const T speed = sqrt(speed2), inverse = T(1) / speed;
  const T cos_alpha = chordwise * inverse, c2 = cos_alpha * cos_alpha;
  const T P =
      T(series.normal[0] + series.normal[1] * cos_alpha) + c2 * T(series.normal[2] + series.normal[3] * cos_alpha);
  const T N = -(T(strip.pressure_kg_m * T(normal * speed)) * P);
  const T behind = cos_alpha * T(T(T(T(-0.208) * c2 + T(0.112)) * c2) + T(-0.286)) + T(0.46);  // d_cp
  const T R = T(strip.circulation_kg * chordwise) * w.y;
  const T all = N + R;
  const T about_axis =
      N * T(strip.leading_edge_m - strip.chord_m * behind) + R * T(strip.leading_edge_m - T(0.5) * strip.chord_m);
  load.force_N.x += all;
  load.moment_Nm.y += about_axis;
  load.moment_Nm.z -= strip.y_m * all;
  if (!slides) return;
  const T Q = T(series.tangential[0] + series.tangential[1] * cos_alpha) +
              c2 * T(T(series.tangential[2] + series.tangential[3] * cos_alpha) + c2 * series.tangential[4]);
  const T tangential = T(strip.pressure_kg_m * speed2) * Q;
  load.force_N.z -= tangential;
  load.moment_Nm.x -= strip.y_m * tangential;
}

/// Adds M_rd, the sum of all dM, and the sum of all dD. `rate_rad_s`: w_y.
template <class T>
FLAPPY_INLINE void add_pitching_drag(const JointedSide<T>& p, const T& rate_rad_s, WingLoad<T>& load) {
  const T squared = abs(rate_rad_s) * rate_rad_s;
  load.force_N.x += p.pitching_force_N_s2 * squared;
  load.moment_Nm.y -= p.rotational_damping_Nm_s2 * squared;
  load.moment_Nm.z -= p.pitching_force_moment_Nm_s2 * squared;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
