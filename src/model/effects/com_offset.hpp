// The torso's centre of mass differs from the vehicle file by (x, y, z) in B; its inertia about it is unchanged. Exact
// if only battery and boards moved. The thrust's moment: 1 mm on a 12 g vehicle is 31 rad/s^2 of pitch with the torso's
// inertia alone, a fifth less with the wings, which are carried along. [1] Goldstein, Classical Mechanics, ch. 5.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct ComOffset {
  static constexpr EffectInfo kInfo{"com_offset", Stage::body, 3, "asymmetry", "Goldstein, ch. 5"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"x_m", -0.02, 0.02, 0.001, -0.003, 0.003},
                                                               {"y_m", -0.02, 0.02, 0.001, -0.003, 0.003},
                                                               {"z_m", -0.02, 0.02, 0.001, -0.003, 0.003}}};

  template <class V>
  static void vehicle(const double (&q)[3], V& v) {
    v.torso.com_m.x += q[0];
    v.torso.com_m.y += q[1];
    v.torso.com_m.z += q[2];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
