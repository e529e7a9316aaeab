// Makes the corrected vehicle of a diagnosis, to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/answer/inference.hpp"

namespace flappy::gap {

/// Returns the vehicle with the parameters and effects of inference.corrected. Its posterior (model::Posterior) has the
/// uncertainty of the parameters and effects of inference.predicting(); effects that inference.corrected has in
/// addition (background magnitudes) count as certain. The minor draws shift parameters and are not in the posterior. If
/// predicting() is the hypothesis none, only the name changes. `vehicle`: the vehicle file; `uncertain`: the same with
/// the priors of its parameters.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 sim::Randomisation uncertain);

}  // namespace flappy::gap
