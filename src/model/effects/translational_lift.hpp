// Translational lift: wings that travel sideways carry more,
//   F_z = gain m v_h^2     v_h: speed in the air across z of B
// the even part of what travel does to a flapping wing, as its pressure goes with the square of velocity; the odd part cancels over a beat.
// [1] Olejnik et al., An experimental study of wind resistance and power consumption in MAVs with a low-speed multi-fan wind system, 2022
//     (arXiv 2202.06723): in forward flight the wings of a flapper carry more, those of a quadrotor hardly.
// The multibody model has it without this entry.
#pragma once

#include "model/effects/mean_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct TranslationalLift {
  static constexpr EffectInfo kInfo{"translational_lift", Stage::air, 1, "", "Olejnik et al. 2022"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gain_per_m", -5, 5, 0.3, -1, 1}}};

  template <class T>
  static FLAPPY_INLINE void mean_load(const T (&q)[1], const MeanState<T>& s, MeanLoads<T>& load) {
    const Vec3<T> v = s.velocity_B_m_s - s.wind_B_m_s;
    load.force_N.z += T(q[0] * s.mass_kg) * T(v.x * v.x + v.y * v.y);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
