// The accelerometer's axes are turned against those of gyro and body by a small rotation vector e, valid for a few
// degrees: measured = R(e) f
// [1] Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 8: cross-axis errors.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct AccelerometerMisalignment {
  static constexpr EffectInfo kInfo{"accelerometer_misalignment", Stage::sensor, 3, "",
                                    "Titterton and Weston 2004, ch. 8"};
  static constexpr std::array<EffectParameter, 3> kParameters{{{"x_rad", -0.3, 0.3, 0.02, -0.06, 0.06},
                                                               {"y_rad", -0.3, 0.3, 0.02, -0.06, 0.06},
                                                               {"z_rad", -0.3, 0.3, 0.02, -0.06, 0.06}}};
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
