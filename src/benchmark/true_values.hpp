// Which figures of the catalogue an effect of a robot of family a comes to.
//
// The robot, sampled without effects, flies; then it predicts its own flights with an effect and without (robot_prediction.hpp), and the
// difference is what the effect changes in their rows. Effects of sensors sense the same flight again. These changes are described by
// basis coefficients of the regime, and measured by C^-1: C has the noise that is left once the robot itself is predicted, the model
// discrepancy of gap::Evidence, and what the simulator's uncertain parameters can take over, which is nobody's size.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "blind/a/flights.hpp"
#include "sim/randomise.hpp"

namespace flappy::benchmark {

/// Whether only what the sensors say has the effect; the motion is the same.
bool acts_on_sensors(blind::Effect effect);

/// "effect.parameter" of the sizes of the entry with which the simulator's noise-free rows change most as the robot's do, of each effect in `effects`
/// that the catalogue has, alone, on flights without any under the same seed. Null where the entry leaves more than half of the change
/// and so is nothing like it, or where the robot does not fly without. Shapes have their prior, sizes none. `uncertain`: draws of the
/// parameters, about any vehicle. Some twenty seconds of one processor.
std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads);

}  // namespace flappy::benchmark
