// Wings of a robot that moves sideways have more lift: F_z = gain m v_h^2, v_h: speed in the air perpendicular to z of
// B. This is the even part of the influence of speed; the odd part cancels over a beat. The multibody model includes it
// without this effect.
// [1] Olejnik et al., An experimental study of wind resistance and power consumption in MAVs with a low-speed multi-fan
// wind system, 2022 (arXiv 2202.06723): in forward flight a flapper's wings have more lift, a quadrotor's hardly.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct TranslationalLift {
  static constexpr EffectInfo kInfo{"translational_lift", Stage::air, 1, "", "Olejnik et al. 2022"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gain_per_m", -5, 5, 0.3, -1, 1}}};

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[1], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const Vec3<T> v = s.velocity_B_m_s - s.wind_B_m_s;
    load.force_N.z += T(q[0] * s.mass_kg) * T(v.x * v.x + v.y * v.y);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
