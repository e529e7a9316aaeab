// Play between motor and wing: motor and gear (phi, all about the stroke axis) turn freely within a dead zone `gap`,
// and press on the wing with the teeth's stiffness k and damping d at its ends:
//   J phi'' = T V - b phi' - f sgn phi' - tau      tau = k (phi - psi -+ gap/2) + d (phi' - psi')
// Rotor inertia J, damping b and friction f, including the small shares of the joint, belong to the motor's side. Both
// rates are taken at the end of the step (implicit Euler): with K = k h + d, D = J/h + b/2 + K and N the terms that
// drive phi' without psi',
//   phi'_new = (N + K psi'_new) / D      tau = k (phi - psi -+ gap/2) + K N / D - K (1 - K/D) psi'_new
// so the teeth act on the wing as a torque and as an inertia h K (1 - K/D), which tends to J + h b/2 for k -> infinity:
// the rigid gear of the base model, which gap = 0 gives exactly.
// [1] Nordin, Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38(10), 2002: the dead-zone
// model with damping. Unlike in their physical model, separating teeth may pull for a moment.
// The body feels the rotor's spin (motor.hpp) at the wing's rate: S (phi' - psi') is neglected. k is the motor's stall
// torque per 0.001 rad, d a damping ratio of 0.1 on J. A flight starts in the middle of the gap.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct GearBacklash {
  static constexpr EffectInfo kInfo{"gear_backlash", Stage::drive, 1, "low_voltage", "Nordin, Gutman 2002"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gap_rad", 0, 0.2, 0.0175, 0, 0.052}}};
  static constexpr int kStates = 8;  // per side: phi - psi, phi' - psi', and N/D and K/D of the step
  static constexpr double kStallDeflection_rad = 0.001, kDampingRatio = 0.1;

  /// Adds phi' - psi' to the motor's rate.
  template <class T>
  static FLAPPY_INLINE void motor(const T (&)[1], const Surroundings<T>&, const StateRows<T>& state,
                                  Sides<Hinges<T>>& h) {
    h.left.motor_rate_rad_s += state.get(1);
    h.right.motor_rate_rad_s += state.get(5);
  }

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    mesh(q[0], s, s.p.left, s.constants.left, s.x.left, state, 0, T(1), h.left);
    mesh(q[0], s, s.p.right, s.constants.right, s.x.right, state, 4, T(-1), h.right);
  }

  template <class T>
  static FLAPPY_INLINE void after(const T (&)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                  const Sides<Hinges<T>>&) {
    const auto turn = [&](int row, const T& psi_rate) {
      const T slip = state.get(row + 2) + T(state.get(row + 3) * psi_rate) - psi_rate;
      state.set(row, state.get(row) + s.step_s * slip);
      state.set(row + 1, slip);
    };
    turn(0, s.x.left.stroke_rate_rad_s);
    turn(4, s.x.right.stroke_rate_rad_s);
  }

 private:
  template <class T>
  static FLAPPY_INLINE void mesh(const T& gap_rad, const Surroundings<T>& s, const SideParameters<T>& p,
                                 const SideConstants<T>& constants, const SideState<T>& x, const StateRows<T>& state,
                                 int row, const T& side, Hinges<T>& h) {
    const T slack = state.get(row), slip = state.get(row + 1), half = T(0.5) * gap_rad;
    const T stiffness = T(p.stroke_torque_per_V_Nm * p.voltage_limit_V) * T(1 / kStallDeflection_rad);
    const T rotor_kg_m2 = h.rotor_kg_m2 + constants.rotor_spin_kg_m2;
    const T damping = T(2 * kDampingRatio) * sqrt(T(stiffness * rotor_kg_m2));
    const T next = slack + s.step_s * slip;
    const T end = where(next > T(0), half, T(-half));
    const auto meshes = abs(next) > half;
    const T k = where(meshes, stiffness, T(0)), K = where(meshes, T(stiffness * s.step_s + damping), T(0));

    const T psi_rate = x.stroke_rate_rad_s, phi_rate = h.motor_rate_rad_s;
    const T inertia = T(rotor_kg_m2 * s.per_step), pressed = k * T(slack - end);
    const T driven = T(T(inertia - T(0.5) * h.damping_Nm_s) * phi_rate) + T(h.torque_per_V_Nm * h.voltage_V) - pressed;
    const T friction = clamp(T(-(driven + K * psi_rate)), T(-h.friction_Nm), h.friction_Nm);
    const T D = inertia + (T(0.5) * h.damping_Nm_s + K), free_rate = T(driven + friction) / D, follows = K / D;
    state.set(row + 2, free_rate);
    state.set(row + 3, follows);

    const T resists = K * T(T(1) - follows);
    const T torque = pressed + T(K * free_rate) - resists * psi_rate;
    h.stroke_torque_Nm += side * torque;
    h.rotor_kg_m2 = resists * s.step_s - constants.rotor_spin_kg_m2;
    h.torque_per_V_Nm = h.damping_Nm_s = h.stiffening_kg_m2 = h.friction_Nm = T(0);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
