// Makes the corrected vehicle of a diagnosis, to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// The vehicle with the parameters and effects of the conclusion alone; its posterior has their uncertainty.
/// `uncertain`: with the minor draws of the inference.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 const sim::Randomisation& uncertain);

}  // namespace flappy::gap
