// A bias of every accelerometer axis that grows with the vibration along it: K_2 (mean over a beat of (f - mean f)^2),
// taken over the previous wing beat, which ends where the phase wraps; 0 until the phase first wraps.
// [1] IEEE Std 1293-2018: the second-order coefficient K_2. Consumer parts: 1e-3 s^2/m (10 mg/g^2 / 9.81 m/s^2).
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct VibrationRectification {
  static constexpr EffectInfo kInfo{"vibration_rectification", Stage::sensor, 1, "", "IEEE Std 1293-2018, annex"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"gain_s2_m", -0.05, 0.05, 0.001, -0.003, 0.003}}};
  static constexpr int kStates =
      11;  // bias; in this beat: samples, sums of the forces and of their squares; last phase
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
