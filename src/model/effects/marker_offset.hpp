// The tracked point lies off the torso origin by d, in B:
//   seen position = p + R_WB d
// [1] Furgale, Rehder and Siegwart, Unified temporal and spatial calibration for multi-sensor systems, IROS 2013: the
//     lever arm between sensors.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct MarkerOffset {
  static constexpr EffectInfo kInfo{"marker_offset", Stage::sensor, 3, "", "Furgale, Rehder, Siegwart, IROS 2013"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"x_m", -0.05, 0.05, 0.002, -0.006, 0.006},
                                                               {"y_m", -0.05, 0.05, 0.002, -0.006, 0.006},
                                                               {"z_m", -0.05, 0.05, 0.002, -0.006, 0.006}}};
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
