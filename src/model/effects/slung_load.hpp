// A weight m on a line of length l that hangs from a hook at (x, y, z) of B; the parameters are m, m x, m y, l and z. It is a pendulum of any amplitude whose
// hook moves with acceleration h'' [1]. With u the unit vector from the hook to the weight, p the weight's place and S the line's tension,
//   m p'' = -m g e_z - m c p' - S u    c = 2 zeta sqrt(g / l)    the robot feels S u at the hook
// The line keeps its length: |u| = 1, so u . u'' = -|u'|^2. The equation along u gives
//   S / m = l |u'|^2 - u . (h'' + g e_z + c h')
// p is kept along x and y, as the line says the rest; to small angles p'' = -g / l (p - h) - c p'. In a simulation S acts
// back on h'' = F / M + S u / M - g e_z, F: all other forces; so (1 + m / M) S / m = l |u'|^2 - u . (F / M + c h').
// Assumes a hook that accelerates as the torso's origin does, but for the place it is at. Neglects the line's mass and
// drag, and that the rotors' jet pushes at the weight. Valid for a line that is taut, up to 60 degrees.
// [1] Cabecinhas, Cunha, Silvestre, A trajectory tracking control law for a quadrotor with slung load, Automatica 106,
//     2019.
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

  /// Least share of the line that points down: 60 degrees.
  static constexpr double kMinDown = 0.5;

  /// u: from the hook to the weight.
  template <class T>
  static FLAPPY_INLINE Vec3<T> direction(const T (&q)[5], const BeatAveragedState<T>& s, const Hanging<T>& weight) {
    const Vec3<T> at = hook(q, s);
    const T x = T(weight.x_m - at.x) / q[3], y = T(weight.y_m - at.y) / q[3];
    return {x, y, -sqrt(max(T(T(1) - T(T(x * x) + T(y * y))), T(kMinDown * kMinDown)))};
  }

  template <class T>
  static FLAPPY_INLINE void beat_averaged_hang(const T (&q)[5], const BeatAveragedState<T>& s, Hanging<T>& weight) {
    const Vec3<T> at = hook(q, s);
    weight = {at.x, at.y, T(0), T(0), s.gravity_m_s2};
  }
  /// Semi-implicit Euler: place and velocity are half a step apart (leapfrog), which keeps the energy of a swing.
  template <class T>
  static FLAPPY_INLINE void beat_averaged_swing(const T (&q)[5], const BeatAveragedState<T>& s, const T& step_s,
                                                Hanging<T>& weight) {
    const Vec3<T> u = direction(q, s, weight);
    const Vec3<T> moves = s.attitude * (s.velocity_B_m_s + cross(s.rate_rad_s, hook_B(q)));  // h'
    const T damping = T(2 * kDamping) * sqrt(T(s.gravity_m_s2 / q[3]));
    const T turns_x = T(weight.velocity_x_m_s - moves.x) / q[3], turns_y = T(weight.velocity_y_m_s - moves.y) / q[3];
    const T turns_z = -T(T(turns_x * u.x) + T(turns_y * u.y)) / u.z;  // as u . u' = 0
    const T reacts = q[0] / s.mass_kg;
    const Vec3<T> free = s.attitude * s.force_m_s2 - T(reacts * weight.tension_m_s2) * u;  // F / M
    const T turning = T(T(turns_x * turns_x) + T(turns_y * turns_y)) + T(turns_z * turns_z);
    const T tension = T(T(q[3] * turning) - T(dot(u, free + damping * moves))) / T(T(1) + reacts);
    weight.tension_m_s2 = max(tension, T(0));
    weight.velocity_x_m_s -= step_s * T(T(weight.tension_m_s2 * u.x) + T(damping * weight.velocity_x_m_s));
    weight.velocity_y_m_s -= step_s * T(T(weight.tension_m_s2 * u.y) + T(damping * weight.velocity_y_m_s));
    weight.x_m += step_s * weight.velocity_x_m_s;
    weight.y_m += step_s * weight.velocity_y_m_s;
  }

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[5], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const Vec3<T> pull = transpose_times(s.attitude, s.weight.tension_m_s2 * direction(q, s, s.weight));
    load.add(q[0] * pull, Vec3<T>{T(0), T(0), q[4]} - s.com_m);
    load.moment_Nm = load.moment_Nm + cross(Vec3<T>{q[1], q[2], T(0)}, pull);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
