// Windings that warm up, each motor separately, and increase in resistance; cold at the start of a flight:
//   R = R_0 (1 + 0.00393 dT)     time d(dT)/dt = rise R i^2 - dT     i = (V - K N phi') / R
// with phi' the motor's rate about the stroke axis. R reduces torque per volt and the damping's share of back-EMF. One
// thermal mass for winding and case, `rise` its whole thermal resistance; neglects that magnets weaken with heat.
// [1] Hughes, Drury, Electric Motors and Drives, 4th ed., 2013, ch. 3. [2] Copper Wire Tables, Circular of the Bureau
// of Standards 31, 3rd ed., 1914: annealed copper, 0.00393 per K at 20 C.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WindingHeating {
  static constexpr EffectInfo kInfo{"winding_heating", Stage::drive, 1, "thrust_loss", "Hughes, Drury 2013"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"rise_K_W", 0, 300, 30, 0, 90}, {"time_s", 0.1, 1000, 60, 20, 100}}};
  static constexpr int kStates = 4;  // dT of left and right, each as a compensated sum (StateRows::add)
  static constexpr double kCopper_1_K = 0.00393;

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&)[2], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    warm(s.constants.left, state.get(0), h.left);
    warm(s.constants.right, state.get(2), h.right);
  }

  template <class T>
  static FLAPPY_INLINE void after(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>& state,
                                  const Sides<Hinges<T>>& h) {
    const auto heat = [&](int row, const SideConstants<T>& f, const Hinges<T>& side) {
      const T across = side.voltage_V - f.back_emf_V_s * side.motor_rate_rad_s;
      const T power = T(across * across) / side.resistance_ohm;
      state.add(row, T(T(s.step_s / q[1]) * T(q[0] * power - state.get(row))));
    };
    heat(0, s.constants.left, h.left);
    heat(2, s.constants.right, h.right);
  }

 private:
  template <class T>
  static FLAPPY_INLINE void warm(const SideConstants<T>& f, const T& rise_K, Hinges<T>& h) {
    const T hotter = T(1) + T(kCopper_1_K) * rise_K, share = T(1) / hotter;
    const T less = T(T(1) - share) * f.electric_damping_Nm_s;
    h.resistance_ohm *= hotter;
    h.torque_per_V_Nm *= share;
    h.stiffening_kg_m2 *= T(T(h.damping_Nm_s - less) / h.damping_Nm_s);
    h.damping_Nm_s -= less;
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
