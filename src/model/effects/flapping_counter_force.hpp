// Flapping counter-force: the half-stroke against the robot's motion meets more air than the one with it. Over a beat
//   F_i = -rate_i m (f / f_nominal) v_i     i = x, y, z in B; v: velocity in the air; along z: heave damping
// Valid for v well below the wings' own speed. The multibody model includes it through the air on its wings.
// [1] Cheng, Deng, Translational and rotational damping of flapping flight and its dynamics and stability at hovering,
// IEEE Trans. Robotics 27(5), 2011: linear in velocity, and larger with stroke amplitude and frequency.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct FlappingCounterForce {
  static constexpr EffectInfo kInfo{"flapping_counter_force", Stage::air, 3, "", "Cheng, Deng 2011"};
  static constexpr std::array<EffectParameter, 3> kParameters{
      {{"x_per_s", 0, 20, 2, 0, 5}, {"y_per_s", 0, 20, 2, 0, 5}, {"z_per_s", 0, 20, 1, 0, 5}}};

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[3], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const Vec3<T> v = s.velocity_B_m_s - s.wind_B_m_s;
    load.force_N = load.force_N - T(s.mass_kg * s.beat_share) * Vec3<T>{q[0] * v.x, q[1] * v.y, q[2] * v.z};
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
