// The corrected vehicle, to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// The vehicle with the parameters and effects of the conclusion and nothing else; its posterior has their remaining uncertainty. `uncertain`: the
/// randomisation with the minor draws of the inference.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 const sim::Randomisation& uncertain);

}  // namespace flappy::gap
