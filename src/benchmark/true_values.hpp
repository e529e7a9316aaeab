// True values for the magnitudes of an effect of a robot of family a, in terms of the catalogue.
//
// The robot, sampled without effects, flies. Then it predicts its own flights with and without an effect (robot_prediction.hpp); the difference is
// the change that the effect makes in the rows. For an effect of a sensor, the same flight is logged again with it. These changes are described by
// coefficients of the regime basis, and measured by C^-1. The covariance C has the noise that remains when the robot predicts itself, the model
// discrepancy of gap::Evidence, and the changes that uncertain parameters of the simulator can make, which carry no information on the magnitude.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "blind/a/flights.hpp"
#include "sim/randomise.hpp"

namespace flappy::benchmark {

/// Whether an effect acts on sensors only, so that the motion stays the same.
bool acts_on_sensors(blind::Effect effect);

/// For each effect in `effects` that the catalogue has: the magnitudes, by "effect.parameter", with which the catalogue's effect changes the
/// simulator's noise-free rows most nearly as the robot's effect changes the robot's. Each effect acts alone, along flights of the same seed without
/// effects. Null if the catalogue's effect leaves half of the change or more, so that it is not alike, or if the robot without effects crashes.
/// Shape parameters have their prior; magnitudes have none. `uncertain`: draws of the parameters, about any vehicle. Takes some twenty seconds of
/// one processor.
std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads);

}  // namespace flappy::benchmark
