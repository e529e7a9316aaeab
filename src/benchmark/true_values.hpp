// True magnitudes of an effect of a family-a robot, in terms of the catalogue. A robot without effects flies, then
// predicts its own flights with and without the effect (robot_prediction.hpp; a sensor's effect: logged again): the
// difference is the change. Its coefficients of the regime basis are measured by C^-1; C has the noise left when the
// robot predicts itself, the discrepancy of gap::Evidence, and changes by uncertain parameters, which carry no
// information.
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

/// For each catalogue effect of `effects`: magnitudes, by "effect.parameter", that change the simulator's noise-free
/// rows most as the robot's does; alone, on flights of the same seed without effects. Null if half of the change or
/// more is left, or the bare robot crashes. Shapes have their prior, magnitudes none. `uncertain` may be of
/// another vehicle: its changes are applied to this one. Takes 20 s of a processor.
std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads);

}  // namespace flappy::benchmark
