// The beat frequency falls with the battery's voltage, because the driver's command is a share of it, for each flapping
// actuator: a' = a (1 + gain (V / V_nominal - 1)). The multibody model has battery_sag instead.
// [1] Chen, Rincon-Mora, Accurate electrical battery model, IEEE Trans. Energy Conversion 21(2), 2006: why V falls.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct BatteryThrust {
  static constexpr EffectInfo kInfo{"battery_thrust", Stage::drive, 1, "thrust_loss", "Chen, Rincon-Mora 2006"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gain", -3, 3, 1, -1.5, 1.5}}};

  template <class T>
  static FLAPPY_INLINE void beat_averaged_drive(const T (&q)[1], BeatAveragedDrive<T>& drive) {
    drive.battery_gain += q[0];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
