// Side force and roll moment near a vertical wall, in proportion to the lift L (along z of B); d: clearance of the
// torso, 0 behind it:
//   F = side_gain L exp(-d / length) n      M_x = roll_gain L exp(-d / length) n_y     n: the wall's normal; n_y in B
// Positive gains push away from the wall and raise the wing farther from it. Only the nearest wall counts.
// [1] Robinson, Chung, Ryan, Computational investigation of micro rotorcraft near-wall hovering aerodynamics, ICUAS
// 2014: small rotors keep their thrust and gain side force and tilting moment, of either sign with distance.
// Exponential as for the ground.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WallEffect {
  static constexpr EffectInfo kInfo{"wall_effect", Stage::world, 2, "", "Robinson, Chung, Ryan 2014"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"side_gain", -0.5, 0.5, 0.03, -0.09, 0.09},
                                                               {"roll_gain_m", -0.02, 0.02, 0.0005, -0.0015, 0.0015},
                                                               {"length_m", 0.005, 0.5, 0.06, 0.03, 0.09}}};

  template <class T>
  static FLAPPY_INLINE void world(const T (&q)[3], const Surroundings<T>& s, const StateRows<T>&, BodyLoad<T>& load) {
    const T near = s.lift_N * exp_negative(T(max(s.wall_clearance_m, T(0)) / q[2]));
    const Vec3<T> normal = transpose_times(s.attitude, Vec3<T>{s.wall_normal_x, s.wall_normal_y, T(0)});
    const Vec3<T> force = T(q[0] * near) * normal;
    load.force_B = load.force_B + force;
    load.moment_B = load.moment_B - cross(s.com_m, force);
    load.moment_B.x += T(q[1] * near) * normal.y;
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
