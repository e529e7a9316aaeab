// Makes the corrected vehicle of a diagnosis, to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/answer/inference.hpp"

namespace flappy::gap {

/// The vehicle with the parameters and effects of inference.predicting(): the conclusion's, and perhaps further effects.
/// Its posterior has their uncertainty. The conclusion none leaves the vehicle as it is, except for its name.
/// The minor draws of `inference` shift parameters and do not enter the posterior.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 sim::Randomisation uncertain);

}  // namespace flappy::gap
