// The thrust is turned from z of B by small angles about x and y, as by crooked wings or markers: F_x = T y, F_y = -T
// x, T: thrust along z. [1] Goldstein, Classical Mechanics, ch. 4: small rotations.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct ThrustAxisTilt {
  static constexpr EffectInfo kInfo{"thrust_axis_tilt", Stage::air, 2, "asymmetry", "Goldstein, ch. 4"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"x_rad", -0.5, 0.5, 0.03, -0.1, 0.1}, {"y_rad", -0.5, 0.5, 0.03, -0.1, 0.1}}};

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[2], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    load.force_N.x += s.thrust_N * q[1];
    load.force_N.y -= s.thrust_N * q[0];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
