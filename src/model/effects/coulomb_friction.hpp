// Dry friction of motor and stroke joint that is larger at rest than in motion (Stribeck), without memory of the
// contact:
//   f (1 + extra exp(-|phi'| / stribeck))      f: friction of the base model; phi': motor's rate about the stroke axis
// [1] Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation methods for the
// control of machines with friction, Automatica 30(7), 1994, sec. 2: stiction, and friction falling with speed.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct CoulombFriction {
  static constexpr EffectInfo kInfo{"coulomb_friction", Stage::drive, 1, "low_voltage",
                                    "Armstrong-Helouvry et al. 1994"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"extra", 0, 20, 1, 0, 3}, {"stribeck_rad_s", 0.1, 10000, 100, 30, 170}}};

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[2], const Surroundings<T>&, const StateRows<T>&, Sides<Hinges<T>>& h) {
    const auto stick = [&](Hinges<T>& side) {
      side.friction_Nm *= T(T(1) + q[0] * exp_negative(T(abs(side.motor_rate_rad_s) / q[1])));
    };
    stick(h.left);
    stick(h.right);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
