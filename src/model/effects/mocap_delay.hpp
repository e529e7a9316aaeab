// Poses arrive later than declared by a constant: a pose declared for the time t shows p(t - delay), R_WB(t - delay),
// interpolated between ends of control periods by Hermite cubics; before the start of a flight, the first pose.
// [1] Furgale, Rehder and Siegwart, Unified temporal and spatial calibration for multi-sensor systems, IROS 2013.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct MocapDelay {
  static constexpr EffectInfo kInfo{"mocap_delay", Stage::sensor, 1, "", "Furgale, Rehder, Siegwart, IROS 2013"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"delay_s", -0.02, 0.02, 0.005, -0.012, 0.012}}};
  static constexpr int kSlots = 64, kRows = 13,
                       kStates = kSlots * kRows;  // true motion at the start of each of the last periods
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
