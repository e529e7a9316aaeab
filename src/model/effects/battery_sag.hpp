// A battery whose voltage falls under load and with discharge, and a driver whose commands are shares d = V / nominal
// of it:
//   V_b = nominal - source_ohm I - fade Q     I = d_l i_l + d_r i_r     i = (d V_b - K N phi') / R     dQ/dt = I
// with phi' the motor's rate about the stroke axis; solved for V_b. The motors get d V_b. I is what a lossless PWM
// bridge draws; energy that a motor returns flows back into the battery. A flight starts with a full battery. Valid
// over the flat part of a discharge; V_b without load is never below 0.
// [1] Chen, Rincon-Mora, Accurate electrical battery model, IEEE Trans. Energy Conversion 21(2), 2006: source voltage
// as a function of charge, less a series resistance times the current; here linear, without its slow RC pairs.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct BatterySag {
  static constexpr EffectInfo kInfo{"battery_sag", Stage::drive, 2, "thrust_loss", "Chen, Rincon-Mora 2006"};
  static constexpr std::array<EffectParameter, 3> kParameters{
      {{"source_ohm", 0, 50, 1, 0, 3}, {"fade_V_C", 0, 5, 0.05, 0, 0.15}, {"nominal_V", 1, 60, 18, 12, 24}}};
  static constexpr int kStates = 2;  // Q as a compensated sum (StateRows::add)

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[3], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    const T share_l = h.left.voltage_V / q[2], share_r = h.right.voltage_V / q[2];
    const T emf_l = s.constants.left.back_emf_V_s * h.left.motor_rate_rad_s;
    const T emf_r = s.constants.right.back_emf_V_s * h.right.motor_rate_rad_s;
    const T per_ohm_l = share_l / h.left.resistance_ohm, per_ohm_r = share_r / h.right.resistance_ohm;
    const T full = max(T(q[2] - q[1] * state.get(0)), T(0));
    const T battery_V = T(full + q[0] * T(per_ohm_l * emf_l + per_ohm_r * emf_r)) /
                        T(T(1) + q[0] * T(per_ohm_l * share_l + per_ohm_r * share_r));
    h.left.source_share = h.right.source_share = battery_V / q[2];
    h.left.voltage_V = share_l * battery_V;
    h.right.voltage_V = share_r * battery_V;
    state.add(0, T(s.step_s * T(per_ohm_l * T(h.left.voltage_V - emf_l) + per_ohm_r * T(h.right.voltage_V - emf_r))));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
