// Force of a wing that meets its own wake after it reversed, as a factor that dies down within the half stroke:
//   k = 1 + gain exp(-t / (decay t_half))      t: since the last reversal; t_half: the half stroke before it
// [1] Dickinson, Lehmann, Sane, Wing rotation and the aerodynamic basis of insect flight, Science 284, 1999: a peak just after
//     reversal, of either sign with the timing of the rotation. [2] Lehmann, The mechanisms of lift enhancement in insect
//     flight, Naturwissenschaften 91, 2004: decays within a tenth to a fifth of the half stroke.
// Phenomenological: the gain stands for what depends on amplitude and rotation. None before the second reversal of a flight.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WakeCapture {
  static constexpr EffectInfo kInfo{"wake_capture", Stage::air, 1, "unsteady_lift", "Dickinson, Lehmann, Sane 1999"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", -1, 5, 0.25, -0.75, 0.75}, {"decay", 0.01, 1, 0.15, 0.05, 0.25}}};
  static constexpr int kStates =
      6;  // of each side: direction of the stroke, time since it changed, the time before that

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>& state,
                                WingWrench<T>& air) {
    constexpr int kRow = side > 0 ? 0 : 3;
    const T rate = of_side<side>(s.x).stroke_rate_rad_s, last = state.get(kRow), since = state.get(kRow + 1);
    const T direction = where(rate == T(0), last, copysign(T(1), rate));
    const auto reversed = T(direction * last) < T(0);
    const T half_s = where(reversed & (since < T(1)), since, state.get(kRow + 2));
    const T now_s = where(reversed, T(0), min(T(since + s.step_s), T(1)));
    state.set(kRow, direction);
    state.set(kRow + 1, now_s);
    state.set(kRow + 2, half_s);
    const T wake = exp_negative(T(now_s / T(q[1] * half_s)));
    air = scaled(air, T(T(1) + q[0] * where(half_s > T(0), wake, T(0))));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
