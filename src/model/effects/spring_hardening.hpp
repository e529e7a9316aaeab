// A stroke spring that stiffens with deflection: -k x - k_3 x^3 with k_3 = k per_rad2, x from its rest angle. A
// negative magnitude softens; down to -1/x^2 the torque still restores. [1] Nayfeh, Mook, Nonlinear Oscillations, 1979,
// ch. 4: resonance rises with the amplitude a by 3/8 per_rad2 a^2 if the spring is the only store of energy.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct SpringHardening {
  static constexpr EffectInfo kInfo{"spring_hardening", Stage::drive, 1, "", "Nayfeh, Mook 1979"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"per_rad2", -0.3, 5, 0.1, -0.3, 0.3}}};

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>&,
                                   Sides<Hinges<T>>& h) {
    const auto harden = [&](Hinges<T>& side, const SideState<T>& x, const T& rest_rad) {
      const T turned = x.stroke_rad - rest_rad, more = T(1) + q[0] * T(turned * turned);
      side.spring_positive_Nm_rad *= more;
      side.spring_negative_Nm_rad *= more;
    };
    harden(h.left, s.x.left, s.p.left.spring_rest_rad);
    harden(h.right, s.x.right, s.p.right.spring_rest_rad);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
