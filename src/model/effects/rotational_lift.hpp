// Circulation of a wing that rotates while it translates (Kramer effect); its force is normal to the wing:
//   F = factor rho C_r |U| theta' c^2 per span,  C_r = pi (0.75 - x_0),  x_0 = 0: the wing turns about its leading edge
// Thin-aerofoil theory: the circulation makes the flow tangent at 3/4 chord, which theta' > 0 moves by 0.75 c theta'
// towards -x on either stroke; the force is towards +x. So a wing that pitches up gains force, one that pitches down
// loses it. U = s w_z r - v_x is assumed to have one sign along the wing, that at r_cp. Moments: the planform's c^2
// r^n, and, because the force is taken at mid-chord, c/2 c^2 r^n about the leading edge, as for added mass. Valid for c
// theta' / U below about 1, so not at rest.
// [1] Sane, Dickinson, The aerodynamic effects of wing rotation and a revised quasi-steady model of flapping flight, J.
// Exp. Biol. 205, 2002 (after Fung 1969, Ellington 1984). C_r measured: 1.55 to 2.1 at x_0 = 0.25 for 1.57.
#pragma once

#include <numbers>

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct RotationalLift {
  static constexpr EffectInfo kInfo{"rotational_lift", Stage::air, 1, "unsteady_lift", "Sane, Dickinson 2002"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"factor", 0, 5, 1, 0, 3}}};
  static constexpr double kCirculation = 0.75 * std::numbers::pi;

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>&, WingWrench<T>& air) {
    constexpr double out = side;
    const SideParameters<T>& p = of_side<side>(s.p);
    const WingPose<T>& g = of_side<side>(s.pose);
    const WingFlow<T> f = flow<side>(s);
    const T per_span = T(out) * f.w.z, at_root = -f.v.x;
    const T forward = copysign(T(1), T(per_span * p.span_to_pressure_m + at_root));
    const T turn = T(T(kCirculation) * q[0]) * T(forward * g.theta_rate);
    // moment1 = rho c^2 R^2 z_cp1, while moment2 and moment0 include a factor 1/2 rho: hence the factors of 2
    const T force = turn * T(per_span * p.moment1 + T(2) * T(at_root * p.moment0));
    const T about_root = turn * T(T(2) * T(per_span * p.moment2) + at_root * p.moment1);  // integral of r dF
    const T arm = T(-out) * about_root;
    const SideConstants<T>& added = of_side<side>(s.constants);  // with rho pi/4 c^2
    const T about_edge =
        T(T(4 / std::numbers::pi) * turn) * T(per_span * added.added_cross_kg_m2 + at_root * added.added_chord_kg_m);
    air.normal_force_N += force;
    air.force_x_N += g.theta.cos * force;
    air.force_z_N -= g.theta.sin * force;
    air.moment_Nm = air.moment_Nm + Vec3<T>{g.theta.sin * arm, -about_edge, g.theta.cos * arm};
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
