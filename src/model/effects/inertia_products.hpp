// Products of the torso's inertia in addition to those of the vehicle file, as fractions of the mean I of its principal
// moments: I_xy + xy I, I_xz + xz I, I_yz + yz I (elements of the tensor: I_xy = -integral of x y). The accepted
// fractions keep the inertia positive if its moments differ by less than a factor of two; beyond 0.15 some combinations
// are impossible. Exact. [1] Goldstein, Classical Mechanics, ch. 5.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct InertiaProducts {
  static constexpr EffectInfo kInfo{"inertia_products", Stage::body, 3, "", "Goldstein, ch. 5"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"xy", -0.25, 0.25, 0.05, -0.15, 0.15},
                                                               {"xz", -0.25, 0.25, 0.05, -0.15, 0.15},
                                                               {"yz", -0.25, 0.25, 0.05, -0.15, 0.15}}};

  template <class V>
  static void vehicle(const double (&q)[3], V& v) {
    auto& i = v.torso.inertia_kg_m2;
    const double mean = (i.xx + i.yy + i.zz) / 3;
    i.xy += q[0] * mean;
    i.xz += q[1] * mean;
    i.yz += q[2] * mean;
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
