// The vehicle that a diagnosis hands back to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// The vehicle with what was concluded and nothing else; its posterior holds what remains uncertain. `uncertain`: with the minor draws of the inference.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 const sim::Randomisation& uncertain);

}  // namespace flappy::gap
