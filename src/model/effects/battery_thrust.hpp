// Wings that beat the slower, the emptier the battery: a driver whose command is a share of the battery's voltage, as logged,
//   a' = a (1 + gain (V / V_nominal - 1))     for each actuator that flaps
// gain 1: the frequency is in proportion to the voltage. The multibody model has the battery itself (battery_sag), and needs no gain.
// [1] Chen, Rincon-Mora, Accurate electrical battery model, IEEE Trans. Energy Conversion 21(2), 2006: why V falls.
#pragma once

#include "model/effects/mean_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct BatteryThrust {
  static constexpr EffectInfo kInfo{"battery_thrust", Stage::drive, 1, "thrust_loss", "Chen, Rincon-Mora 2006"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gain", -3, 3, 1, -1.5, 1.5}}};

  template <class T>
  static FLAPPY_INLINE void mean_drive(const T (&q)[1], MeanDrive<T>& drive) {
    drive.battery_gain += q[0];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
