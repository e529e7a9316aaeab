// After a reversal, a wing meets the air that it had set in motion, which decays within the half stroke: the
// blade-element force at the rate |psidot| + w less that at |psidot|,
//   w = gain p exp(-t / (decay t_half))
// t: time since the last reversal; t_half, p: duration and highest rate of the half stroke before it. 0 before the
// second reversal of a flight. Phenomenological: the gain stands for the influence of amplitude and rotation.
// [1] Dickinson, Lehmann, Sane, Wing rotation and the aerodynamic basis of insect flight, Science 284, 1999: a peak of
// force just after reversal, where the wing itself hardly moves, of either sign with the timing of the rotation.
// [2] Lehmann, The mechanisms of lift enhancement in insect flight, Naturwissenschaften 91, 2004: decays within a tenth
// to a fifth of the half stroke.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WakeCapture {
  static constexpr EffectInfo kInfo{"wake_capture", Stage::air, 1, "unsteady_lift", "Dickinson, Lehmann, Sane 1999"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", -1, 1, 0.08, -0.24, 0.24}, {"decay", 0.01, 1, 0.15, 0.05, 0.25}}};
  /// Per side: direction of the stroke, time since the last reversal, duration of the half stroke before it; highest
  /// rate since that reversal, and in the half stroke before it.
  static constexpr int kStates = 10;

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>& state,
                                WingWrench<T>& air) {
    constexpr int kRow = side > 0 ? 0 : 5;
    const WingPose<T>& pose = of_side<side>(s.pose);
    const T rate = pose.beta_rate, last = state.get(kRow), since = state.get(kRow + 1), highest = state.get(kRow + 3);
    const T direction = where(rate == T(0), last, copysign(T(1), rate));
    const auto reversed = T(direction * last) < T(0), after_a_stroke = reversed & (since < T(1));
    const T half_s = where(after_a_stroke, since, state.get(kRow + 2));
    const T before = where(after_a_stroke, highest, state.get(kRow + 4));
    const T now_s = where(reversed, T(0), min(T(since + s.step_s), T(1)));
    state.set(kRow, direction);
    state.set(kRow + 1, now_s);
    state.set(kRow + 2, half_s);
    state.set(kRow + 3, where(reversed, abs(rate), max(highest, abs(rate))));
    state.set(kRow + 4, before);
    const T wake = T(q[0] * before) * exp_negative(T(now_s / T(q[1] * half_s)));
    WingFlow<T> met = flow<side>(s);
    const SideParameters<T>& p = of_side<side>(s.p);
    const WingWrench<T> own = blade_element<side>(p, pose.theta, pose.theta_rate, met.v, met.w);
    met.w.z += T(direction * where(half_s > T(0), wake, T(0)));
    const WingWrench<T> with = blade_element<side>(p, pose.theta, pose.theta_rate, met.v, met.w);
    air.normal_force_N += with.normal_force_N - own.normal_force_N;
    air.force_x_N += with.force_x_N - own.force_x_N;
    air.force_z_N += with.force_z_N - own.force_z_N;
    air.moment_Nm = air.moment_Nm + (with.moment_Nm - own.moment_Nm);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
