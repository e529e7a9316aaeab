// Air that a wing accelerates: strips of rho pi/4 c^2 per span, which move with the velocity v_n of mid-chord along the
// wing's normal (+x of the wing), and rho pi/128 c^4 per span, which turns about mid-chord,
//   dF = -factor rho pi/4 c^2 v_n' dr   dM = -factor rho pi/128 c^4 Omega_y' dr   v_n = v_x - c/2 Omega_y - s r Omega_z
// v: velocity of the shoulder in the air, Omega: angular velocity of the wing, in the wing's frame; ': rate of these
// components. So force and moments are rates of three momenta, linear in u = (v_x, Omega_y, Omega_z) with the
// planform's c^2 r^n. In time, wing and body feel the difference of the momenta of two steps one step later, so no
// momentum is lost. For the hinges, their own part is inertia in the same step, less its lagged share, because added
// mass may exceed the wing's own. The body's part may lag: it is below a tenth of the body's mass.
// [1] Sane, Dickinson, J. Exp. Biol. 205, 2002 (after Sedov 1965). [2] Whitney, Wood, J. Fluid Mech. 660, 2010: like
// them, without Kirchhoff's terms Omega x momentum, because separated flow has no leading-edge suction.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct AddedMass {
  static constexpr EffectInfo kInfo{"added_mass", Stage::wing, 1, "wing_inertia", "Sane, Dickinson 2002"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"factor", 0, 5, 1, 0, 3}}};
  static constexpr int kStates = 11;  // 1 after the first step; per side: u, beta', theta' of the last step

  template <int side, class T>
  static FLAPPY_INLINE Vec3<T> motion(const Surroundings<T>& s) {
    const WingPose<T>& g = of_side<side>(s.pose);
    const WingFlow<T> f = flow<side>(s);
    return {g.theta.cos * f.v.x - g.theta.sin * f.v.z, f.w.y + g.theta_rate, g.theta.sin * f.w.x + g.theta.cos * f.w.z};
  }

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    carry<+1>(q[0], s, state, h.left);
    carry<-1>(q[0], s, state, h.right);
  }

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                WingWrench<T>& air) {
    constexpr double out = side;
    constexpr int kRow = side > 0 ? 1 : 6;
    const SideConstants<T>& f = of_side<side>(s.constants);
    const WingPose<T>& g = of_side<side>(s.pose);
    const Vec3<T> u = motion<side>(s), last{state.get(kRow), state.get(kRow + 1), state.get(kRow + 2)};
    const T rate = T(q[0] * s.per_step) * state.get(0);
    const Vec3<T> d = rate * (u - last);
    const T span = T(out) * d.z;
    const T force = -(f.added_kg * d.x - (f.added_chord_kg_m * d.y + f.added_span_kg_m * span));
    const T about_y = f.added_chord_kg_m * d.x - (f.added_chord2_kg_m2 * d.y + f.added_cross_kg_m2 * span);
    const T about_z = T(out) * T(f.added_span_kg_m * d.x - (f.added_cross_kg_m2 * d.y + f.added_span2_kg_m2 * span));
    air.normal_force_N += force;
    air.force_x_N += g.theta.cos * force;
    air.force_z_N -= g.theta.sin * force;
    air.moment_Nm = air.moment_Nm + Vec3<T>{g.theta.sin * about_z, about_y, g.theta.cos * about_z};
  }

  template <class T>
  static FLAPPY_INLINE void after(const T (&)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                  const Sides<Hinges<T>>&) {
    state.set(0, T(1));
    keep<+1>(s, state);
    keep<-1>(s, state);
  }

 private:
  template <int side, class T>
  static FLAPPY_INLINE void carry(const T& factor, const Surroundings<T>& s, const StateRows<T>& state, Hinges<T>& h) {
    constexpr int kRow = side > 0 ? 1 : 6;
    const SideConstants<T>& f = of_side<side>(s.constants);
    const WingPose<T>& g = of_side<side>(s.pose);
    const T stroke = factor * T(f.added_span2_kg_m2 * T(g.theta.cos * g.theta.cos));
    const T rotation = factor * f.added_chord2_kg_m2;
    const T both = T(double(side)) * T(factor * T(f.added_cross_kg_m2 * g.theta.cos));
    const T rate = s.per_step * state.get(0);
    const T d_beta = rate * T(g.beta_rate - state.get(kRow + 3)),
            d_theta = rate * T(g.theta_rate - state.get(kRow + 4));
    h.rotor_kg_m2 += stroke;
    h.rotation_inertia_kg_m2 += rotation;
    h.cross_inertia_kg_m2 += both;
    h.stroke_torque_Nm += stroke * d_beta + both * d_theta;
    h.rotation_torque_Nm += rotation * d_theta + both * d_beta;
  }

  template <int side, class T>
  static FLAPPY_INLINE void keep(const Surroundings<T>& s, const StateRows<T>& state) {
    constexpr int kRow = side > 0 ? 1 : 6;
    const Vec3<T> u = motion<side>(s);
    const WingPose<T>& g = of_side<side>(s.pose);
    state.set(kRow, u.x);
    state.set(kRow + 1, u.y);
    state.set(kRow + 2, u.z);
    state.set(kRow + 3, g.beta_rate);
    state.set(kRow + 4, g.theta_rate);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
