// The tracked point is offset from the torso origin by d, in B: seen position = p + R_WB d
// [1] Furgale, Rehder and Siegwart, Unified temporal and spatial calibration for multi-sensor systems, IROS 2013.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct MarkerOffset {
  static constexpr EffectInfo kInfo{"marker_offset", Stage::sensor, 3, "", "Furgale, Rehder, Siegwart, IROS 2013"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"x_m", -0.05, 0.05, 0.002, -0.006, 0.006},
                                                               {"y_m", -0.05, 0.05, 0.002, -0.006, 0.006},
                                                               {"z_m", -0.05, 0.05, 0.002, -0.006, 0.006}}};

  /// In addition, the specific force of the tracked point is larger by w' x d + w x (w x d).
  static constexpr std::array<EffectParameter, 3> kBeatAveragedParameters{{{"x_m", -0.5, 0.5, 0.02, -0.06, 0.06},
                                                                           {"y_m", -0.5, 0.5, 0.02, -0.06, 0.06},
                                                                           {"z_m", -0.5, 0.5, 0.02, -0.06, 0.06}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_seen(const T (&q)[3], const BeatAveragedState<T>& s, Vec3<T>& force_m_s2) {
    const Vec3<T> d{q[0], q[1], q[2]};
    force_m_s2 = force_m_s2 + (cross(s.turning_rad_s2, d) + cross(s.rate_rad_s, cross(s.rate_rad_s, d)));
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
