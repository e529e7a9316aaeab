// A weight m on a line of length l that hangs from a hook at (x, y, z) of B; the parameters are m, m x, m y, l and z. Its swing s, the horizontal part of the line
// from the hook on, is that of a pendulum whose hook moves, for small angles [1]; the line pulls at the hook:
//   p'' = -g / l s - 2 zeta sqrt(g / l) p'    s = p - hook    F = (m g / l s_x, m g / l s_y, -m g)  in W
// p: position of the weight in W. The moment is that of F at the hook. Neglects the line's mass, and how accelerations
// along z change the line's tension.
// [1] Cabecinhas, Cunha, Silvestre, A trajectory tracking control law for a quadrotor with slung load, Automatica 106,
//     2019: the whole equations.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct SlungLoad {
  static constexpr EffectInfo kInfo{"slung_load", Stage::world, 3, "added_weight", "Cabecinhas et al. 2019"};
  static constexpr std::array<EffectParameter, 5> kParameters{{{"mass_kg", 0, 0.1, 0.003, 0, 0.01},
                                                               {"moment_x_kg_m", -0.01, 0.01, 0, -3e-4, 3e-4},
                                                               {"moment_y_kg_m", -0.01, 0.01, 0, -3e-4, 3e-4},
                                                               {"length_m", 0.01, 5, 0.5, 0.1, 1.2},
                                                               {"z_m", -0.5, 0.5, 0, -0.03, 0.03}}};
  /// A weight below this counts as one of this for the place of its hook.
  static constexpr double kMinPlaced_kg = 1e-4;
  /// zeta, of the air and the line: a swing falls to a fifth within five periods. A choice.
  static constexpr double kDamping = 0.05;

  template <class T>
  static FLAPPY_INLINE Vec3<T> hook_B(const T (&q)[5]) {
    const T placed_kg = max(q[0], T(kMinPlaced_kg));
    return {q[1] / placed_kg, q[2] / placed_kg, q[4]};
  }
  template <class T>
  static FLAPPY_INLINE Vec3<T> hook(const T (&q)[5], const BeatAveragedState<T>& s) {
    return s.position_m + s.attitude * hook_B(q);
  }

  template <class T>
  static FLAPPY_INLINE void beat_averaged_hang(const T (&q)[5], const BeatAveragedState<T>& s, Hanging<T>& weight) {
    const Vec3<T> at = hook(q, s);
    weight = {at.x, at.y, T(0), T(0)};
  }
  /// Semi-implicit Euler: place and velocity are half a step apart (leapfrog), which keeps the energy of a swing.
  template <class T>
  static FLAPPY_INLINE void beat_averaged_swing(const T (&q)[5], const BeatAveragedState<T>& s, const T& step_s,
                                                Hanging<T>& weight) {
    const Vec3<T> at = hook(q, s);
    const T stiffness = s.gravity_m_s2 / q[3], damping = T(2 * kDamping) * sqrt(stiffness);
    weight.velocity_x_m_s += step_s * T(T(stiffness * T(at.x - weight.x_m)) - T(damping * weight.velocity_x_m_s));
    weight.velocity_y_m_s += step_s * T(T(stiffness * T(at.y - weight.y_m)) - T(damping * weight.velocity_y_m_s));
    weight.x_m += step_s * weight.velocity_x_m_s;
    weight.y_m += step_s * weight.velocity_y_m_s;
  }

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[5], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const Vec3<T> at = hook(q, s);
    const T per_m = s.gravity_m_s2 / q[3];
    const Vec3<T> pull = transpose_times(
        s.attitude, Vec3<T>{per_m * T(s.weight.x_m - at.x), per_m * T(s.weight.y_m - at.y), -s.gravity_m_s2});
    load.add(q[0] * pull, Vec3<T>{T(0), T(0), q[4]} - s.com_m);
    load.moment_Nm = load.moment_Nm + cross(Vec3<T>{q[1], q[2], T(0)}, pull);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
