// A servo that pitches the robot by moving the stroke plane, or the wings' dihedral, also pushes it forward:
//   F_x = m (shift s + swing ds/dt)     s: sum of the actuators that move the stroke plane
// The first term is the tilt of the thrust, the second the air that the swung wings push.
// [1] Karasek, Muijres, De Wagter, Remes, de Croon, A tailless aerial robotic flapper reveals that flies use torque
// coupling in rapid banked turns, Science 361, 2018: dihedral shifts the thrust against the centre of mass.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct StrokePlaneActuation {
  static constexpr EffectInfo kInfo{"stroke_plane_actuation", Stage::drive, 2, "", "Karasek et al. 2018"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"shift_m_s2", -200, 200, 10, -20, 20}, {"swing_m_s", -20, 20, 1, -2, 2}}};

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[2], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    load.force_N.x += s.mass_kg * T(q[0] * s.stroke_plane + q[1] * s.stroke_plane_1_s);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
