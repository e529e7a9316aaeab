// Makes the result of a diagnosis, plain data, from what was inferred: losses and closures in flights held out,
// estimates, suspects, and where residuals lie.
#pragma once

#include <string>
#include <vector>

#include "gap/answer/inference.hpp"

namespace flappy::gap {

/// The result for faulty data: the verdict `data`. `folders`: of the logs.
Diagnosis result_of(const std::vector<std::string>& folders, std::vector<flightlog::DataFault> faults);

/// Returns the result without warnings, folders of the references, closed-loop check and proposed flight: diagnose(),
/// fly_closed_loop() and propose_experiment() add these. `folders`: [test flight]. `uncertain`: with its minor draws at
/// those of the inference.
Diagnosis result_of(const std::vector<std::string>& folders, const Flights& flights,
                    const sim::Randomisation& uncertain, const Inference& inference);

/// Magnitudes and shape parameters of the effects of a hypothesis, with 90 % intervals; empty without a fit.
std::vector<Estimate> estimates_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain);

}  // namespace flappy::gap
