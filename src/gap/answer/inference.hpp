// The whole of a diagnosis, from flights to the probabilities of all hypotheses. In this order: the robot's parameters
// (RobotFit); evidence of hypotheses without effects; screening of the catalogue; single effects, then sets and
// remainders (EffectFits); flights held out; verdict (verdict.hpp); corrected vehicle. What a step does differently in
// a contrast, or for a beat-averaged vehicle, is in the class Question (gap/question/).
#pragma once

#include "gap/question/inferred.hpp"

namespace flappy::gap {

/// Diagnoses the test flights of one robot. After a stop (InferenceOptions::progress) it decides among the hypotheses
/// fitted by then. `uncertain`: the vehicle file with the priors of its parameters. `reference`: the fit of
/// flights.references; null if there are none. io::InputError as from RobotFit.
Inference infer(const Flights& flights, const sim::Randomisation& uncertain, InferenceOptions options,
                const ReferenceFit* reference = nullptr);

}  // namespace flappy::gap
