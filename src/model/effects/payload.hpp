// A weight m at (x, y, z) of the body: it changes mass, centre of mass and inertia (add_mass.hpp). The parameters are m
// and m x, m y, m z, in which a trim is linear. A weight below 0.1 g counts as one
// of 0.1 g for the inertia.
// [1] Goldstein, Classical Mechanics, ch. 5.
#pragma once

#include <algorithm>

#include "model/effects/add_mass.hpp"
#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct Payload {
  static constexpr EffectInfo kInfo{"payload", Stage::body, 4, "added_weight", "Goldstein, ch. 5"};
  static constexpr std::array<EffectParameter, 4> kParameters{{{"mass_kg", 0, 0.1, 0.003, 0, 0.01},
                                                               {"moment_x_kg_m", -0.01, 0.01, 0, -3e-4, 3e-4},
                                                               {"moment_y_kg_m", -0.01, 0.01, 0, -3e-4, 3e-4},
                                                               {"moment_z_kg_m", -0.01, 0.01, 0, -1e-4, 1e-4}}};
  static constexpr double kMinPlaced_kg = 1e-4;

  template <class V>
  static void vehicle(const double (&q)[4], V& v) {
    const double before_kg = v.torso.mass_kg, all_kg = before_kg + q[0], placed_kg = std::max(q[0], kMinPlaced_kg);
    const auto c = v.torso.com_m;
    const double at[] = {q[1] / placed_kg, q[2] / placed_kg, q[3] / placed_kg};
    add_mass(q[0], at, v.torso);
    v.torso.com_m = {(before_kg * c.x + q[1]) / all_kg, (before_kg * c.y + q[2]) / all_kg,
                     (before_kg * c.z + q[3]) / all_kg};
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
