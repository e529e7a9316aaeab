// Vehicles with four angles a wing that several tests fly.
#pragma once

#include "flappy/vehicle.hpp"
#include "vehicles.hpp"

namespace flappy::test {

/// Wings of the nominal flapper, as far as the air goes.
inline void put_plain_planform(model::Vehicle& v) {
  const model::Vehicle plain = nominal();
  v.left.planform = plain.left.planform;
  v.right.planform = plain.right.planform;
}

}  // namespace flappy::test
