// Wings that come together at the end of a stroke separate with more circulation, as a factor on the lift of both:
//   k = 1 + gain e      e = max(S((a - contact) / width), remaining e)      the remaining e decays by
//   d e/dt = -e |psidot| R / (2 c)      S(x) = 3 x^2 - 2 x^3 in [0, 1]
// a: the smaller of both strokes' deflections to one side (front and rear alike); 0 if they differ in sign. Wing tips
// are 2 (y_s + R cos a) apart and close by 2 R per radian near a = pi/2: by one chord over width = c / 2R, within which
// the gain rises fully from contact_rad (at the typical 1.3 rad the tips are three chords apart, at 1.62 rad one). It
// decays while the tip travels two chords, as a started vortex is left behind (Wagner 1925). Only the lift grows,
// though [1] measured more drag, too. The parameter is the gain at contact; its mean over a beat is smaller.
// [1] Lehmann, Sane, Dickinson, The aerodynamic effects of wing-wing interaction in flapping insect wings, J. Exp.
// Biol. 208, 2005: up to 17 % of a stroke's lift, after the reversal, with wings 10 to 12 deg apart. [2] Weis-Fogh, J.
// Exp. Biol. 59, 1973: each wing's bound vortex is the other's starting vortex, so circulation need not wait for one to
// be shed.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct ClapAndFling {
  static constexpr EffectInfo kInfo{"clap_and_fling", Stage::air, 1, "", "Lehmann, Sane, Dickinson 2005"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", 0, 5, 0.5, 0, 1.5}, {"contact_rad", 0.3, 1.7, 1.3, 1.1, 1.5}}};
  static constexpr int kStates = 2;  // e of each side

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>& state,
                                WingWrench<T>& air) {
    constexpr int kRow = side > 0 ? 0 : 1;
    constexpr double kChords = 2;
    const T left = s.x.left.stroke_rad, right = s.x.right.stroke_rad;
    const T together = max(min(left, right), min(T(-left), T(-right)));
    const SideConstants<T>& f = of_side<side>(s.constants);
    const T x = clamp(T(T(together - q[1]) * T(T(2) * f.wing_length_m)) / f.mean_chord_m, T(0), T(1));
    const T travel_m = T(abs(of_side<side>(s.x).stroke_rate_rad_s) * s.step_s) * f.wing_length_m;
    const T kept = max(T(1) - travel_m / T(T(kChords) * f.mean_chord_m), T(0));
    const T e = max(T(T(x * x) * T(T(3) - T(2) * x)), T(state.get(kRow) * kept));
    state.set(kRow, e);
    air = with_lift(air, T(T(1) + q[0] * e));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
