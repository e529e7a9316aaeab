// Makes the corrected vehicle of a diagnosis, to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/answer/inference.hpp"

namespace flappy::gap {

/// The vehicle with the parameters and effects of inference.corrected. Its posterior (model::Posterior) has the
/// uncertainty of parameters and effects of inference.predicting(); background magnitudes are certain there. Minor
/// draws of `inference` shift parameters and do not enter the posterior. The conclusion none leaves the vehicle as it
/// is, except for its name. `vehicle`: the vehicle file; `uncertain`: the same with the priors of its parameters.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 sim::Randomisation uncertain);

}  // namespace flappy::gap
