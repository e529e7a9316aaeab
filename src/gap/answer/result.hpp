#pragma once

#include <string>
#include <vector>

#include "gap/answer/inference.hpp"

namespace flappy::gap {

/// The result for faulty data. `folders`: of the logs.
Diagnosis result_of(const std::vector<std::string>& folders, std::vector<flightlog::DataFault> faults);

/// The result without closed-loop check and proposed flight. `uncertain`: with the minor draws of the inference.
Diagnosis result_of(const std::vector<std::string>& folders, const Flights& flights,
                    const sim::Randomisation& uncertain, const Inference& inference);

/// Magnitudes and shape parameters of the effects of a hypothesis, with 90 % intervals.
std::vector<Estimate> estimates_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain);

}  // namespace flappy::gap
