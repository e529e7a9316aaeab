// Thrust gained near a ceiling, as a factor on the lift of the wings:
//   k = 1 + gain exp(-h / length)      h: clearance of the stroke plane to the ceiling, 0 above it
// The force in the plane of the strokes is unchanged, as for the ground. Assumes a level attitude and a flat ceiling.
// [1] Hsiao, Chirarattananon, Ceiling effects for hybrid aerial-surface locomotion of small rotorcraft, IEEE/ASME
// Trans. Mechatronics 24(5), 2019: thrust rises monotonically at constant power, about 1.1 at half a rotor radius. Near
// contact the power in [1] falls to a third, more than this exponential (He et al. 2019, for the ground) can describe.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct CeilingEffect {
  static constexpr EffectInfo kInfo{"ceiling_effect", Stage::air, 1, "thrust_loss", "Hsiao, Chirarattananon 2019"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", 0, 1, 0.15, 0, 0.45}, {"length_m", 0.005, 0.5, 0.06, 0.03, 0.09}}};

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>&, WingWrench<T>& air) {
    const T clearance = max(T(s.ceiling_z_m - stroke_plane_z(s)), T(0));
    air = with_lift(air, T(T(1) + q[0] * exp_negative(T(clearance / q[1]))));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
