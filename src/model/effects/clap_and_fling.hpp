// Wings that come together at the end of a stroke, as a factor on the air on both, clap and fling alike:
//   k = 1 + gain S((a - contact) / width)      S(x) = 3 x^2 - 2 x^3 in [0, 1]
// a: how far both strokes have gone to one side, the smaller of the two (front and rear alike); 0 where they differ in sign.
// Wing tips are 2 (y_s + R cos a) apart, closing by 2 R per radian near a = pi/2; the neighbour is felt within about a chord
// (Sun and Yu 2003), so the full gain is reached after width = c / 2R.
// [1] Lehmann, Sane, Dickinson, The aerodynamic effects of wing-wing interaction in flapping insect wings, J. Exp. Biol. 208,
//     2005: up to 17 % of the lift of a stroke, only near the reversal. [2] Weis-Fogh, J. Exp. Biol. 59, 1973.
// The gain is that at contact; the mean over a beat is smaller by the share of the force that falls beyond `contact_rad`.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct ClapAndFling {
  static constexpr EffectInfo kInfo{"clap_and_fling", Stage::air, 1, "", "Lehmann, Sane, Dickinson 2005"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", 0, 5, 0.5, 0, 1.5}, {"contact_rad", 0.3, 1.7, 1.4, 1.2, 1.6}}};

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>&, WingWrench<T>& air) {
    const T left = s.x.left.stroke_rad, right = s.x.right.stroke_rad;
    const T together = max(min(left, right), min(T(-left), T(-right)));
    const SideFigures<T>& f = of_side<side>(s.figures);
    const T x = clamp(T(T(together - q[1]) * T(T(2) * f.wing_length_m)) / f.mean_chord_m, T(0), T(1));
    air = scaled(air, T(T(1) + q[0] * T(T(x * x) * T(T(3) - T(2) * x))));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
