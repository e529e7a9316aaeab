// Each actuator of a beat-averaged robot makes less of its loads by a share: a wing or propeller torn, cut or dirty. All
// products of the vehicle's expressions that contain the actuator are less by that share, so the moment by its arm is,
// too. The actuators count in the order of their names; those after the fourth lose nothing.
// [1] Muijres et al., J. Exp. Biol. 220, 2017: the force of a damaged wing falls with its area.
#pragma once

#include <algorithm>

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct ActuatorLoss {
  static constexpr std::size_t kActuators = 4;
  static constexpr EffectInfo kInfo{"actuator_loss", Stage::body, static_cast<int>(kActuators), "",
                                    "Muijres et al. 2017"};
  static constexpr std::array<EffectParameter, kActuators> kParameters{{{"loss_1", 0, 0.9, 0.1, 0, 0.3},
                                                                        {"loss_2", 0, 0.9, 0, 0, 0.3},
                                                                        {"loss_3", 0, 0.9, 0, 0, 0.3},
                                                                        {"loss_4", 0, 0.9, 0, 0, 0.3}}};

  template <class V>
  static void vehicle(const double (&q)[kActuators], V& v) {
    auto& actuators = v.beat_averaged->actuators;
    for (std::size_t k = 0; k < std::min(kActuators, actuators.size()); ++k) actuators[k].load_share *= 1 - q[k];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
