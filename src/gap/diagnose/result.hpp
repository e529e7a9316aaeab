// Summarises what the stages of a diagnosis found as its result.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// Of data that forbid a diagnosis. `folders`: of the logs.
Diagnosis result_of(const std::vector<std::string>& folders, std::vector<flightlog::DataFault> faults);

/// Without closed loop and next experiment. `uncertain`: with the minor draws of the inference.
Diagnosis result_of(const std::vector<std::string>& folders, const Flights& flights,
                    const sim::Randomisation& uncertain, const Inference& inference);

/// Magnitudes and shape parameters of the effects of a hypothesis.
std::vector<Estimate> estimates_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain);

}  // namespace flappy::gap
