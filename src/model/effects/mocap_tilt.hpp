// The world frame of motion capture is tilted against the vertical by a small rotation vector e about its x and y:
//   seen position = R(e) p, seen attitude = R(e) q
// [1] Furgale, Rehder and Siegwart, Unified temporal and spatial calibration for multi-sensor systems, IROS 2013: the
// direction of gravity as an unknown of the calibration.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct MocapTilt {
  static constexpr EffectInfo kInfo{"mocap_tilt", Stage::sensor, 2, "world_force",
                                    "Furgale, Rehder, Siegwart, IROS 2013"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"x_rad", -0.3, 0.3, 0.01, -0.03, 0.03}, {"y_rad", -0.3, 0.3, 0.01, -0.03, 0.03}}};

  /// Gravity is subtracted along the wrong vertical, which adds e x (0, 0, g) to the specific force in W.
  template <class T>
  static FLAPPY_INLINE void beat_averaged_seen(const T (&q)[2], const BeatAveragedState<T>& s, Vec3<T>& force_m_s2) {
    force_m_s2 =
        force_m_s2 + transpose_times(s.attitude, Vec3<T>{q[1] * s.gravity_m_s2, -T(q[0] * s.gravity_m_s2), T(0)});
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
