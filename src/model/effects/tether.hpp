// A cable from the torso to an anchor on the ground. The torso carries the weight of the part that hangs, and is pulled
// weakly towards the anchor. Forces in W, acting at (0, 0, attached_z) of B:
//   F_z = -line g h      F_x = -stiffness (x - anchor_x)      F_y = -stiffness (y - anchor_y)      h: height, >= 0
// [1] Irvine, Cable Structures, 1981, ch. 1: the end of a slack line carries the weight of the hanging part, and is
// pulled sideways in proportion to small offsets. Neglects the line's inertia, damping and drag.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct Tether {
  // Each parameter: name, least and greatest accepted value, value if a vehicle file gives none, 5 % and 95 % points of
  // the prior. The first 2 are magnitudes: without them there is no effect. Short flights cannot tell the effects of a
  // group ("world_force") apart.
  static constexpr EffectInfo kInfo{"tether", Stage::world, 2, "world_force", "Irvine 1981"};
  static constexpr std::array<EffectParameter, 5> kParameters{{{"line_kg_m", 0, 0.1, 0.0002, 0, 0.0006},
                                                               {"stiffness_N_m", 0, 1, 0.001, 0, 0.003},
                                                               {"anchor_x_m", -100, 100, 0, -0.5, 0.5},
                                                               {"anchor_y_m", -100, 100, 0, -0.5, 0.5},
                                                               {"attached_z_m", -0.1, 0.1, -0.01, -0.02, 0}}};

  /// Adds force and moment about the centre of mass to `load`, in B. `q`: the parameters above, in their order.
  template <class T>
  static FLAPPY_INLINE void world(const T (&q)[5], const Surroundings<T>& s, const StateRows<T>&, BodyLoad<T>& load) {
    const Vec3<T>& at = s.position_m;
    const T height = max(T(at.z - s.ground_z_m), T(0));
    const Vec3<T> force = transpose_times(
        s.attitude, Vec3<T>{q[1] * T(q[2] - at.x), q[1] * T(q[3] - at.y), -T(T(q[0] * s.gravity) * height)});
    load.force_B = load.force_B + force;
    load.moment_B = load.moment_B + cross(Vec3<T>{T(0), T(0), q[4]} - s.com_m, force);
  }

  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[5], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const T height = max(T(s.position_m.z - s.ground_z_m), T(0));
    const Vec3<T> force{q[1] * T(q[2] - s.position_m.x), q[1] * T(q[3] - s.position_m.y),
                        -T(T(q[0] * s.gravity_m_s2) * height)};
    load.add(transpose_times(s.attitude, force), Vec3<T>{T(0), T(0), q[4]} - s.com_m);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
