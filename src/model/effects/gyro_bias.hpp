// Drift of a gyro's bias from the flight's start, as the part warms up: b(t) = drift (1 - exp(-t / warm_up)), our
// assumption; data sheets of consumer parts give seconds to minutes. A random walk is left to the filters' own process
// noise.
// [1] El-Sheimy, Hou, Niu, Analysis and modeling of inertial sensors using Allan variance, IEEE Trans. Instrum. Meas.
// 57(1), 2008: the slow noise of MEMS gyros.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct GyroBias {
  static constexpr EffectInfo kInfo{"gyro_bias", Stage::sensor, 3, "",
                                    "El-Sheimy, Hou, Niu, IEEE Trans. Instrum. Meas. 57(1), 2008"};
  static constexpr std::array<EffectParameter, 4> kParameters{{{"x_rad_s", -0.5, 0.5, 0.03, -0.09, 0.09},
                                                               {"y_rad_s", -0.5, 0.5, 0.03, -0.09, 0.09},
                                                               {"z_rad_s", -0.5, 0.5, 0.03, -0.09, 0.09},
                                                               {"warm_up_s", 0.5, 600, 15, 3, 27}}};
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
