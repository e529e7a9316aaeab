// Residuals in held-out flights: each flight is predicted by a fit to other flights.
#pragma once

#include <vector>

#include "gap/fit/fit.hpp"

namespace flappy::gap {

struct FittedHypothesis {
  Hypothesis hypothesis;
  const Fit* fit;
};

/// For each fold, [flight] whether the flight is in another one; if there is only one fold, all are.
std::vector<std::vector<char>> others_of(const Flights& flights, const std::vector<int>& fold);

/// As Question::held_out: vehicles fitted to the other folds are simulated in flights without references.
/// `less_nuisances`: less what the nuisance regressors explain.
std::vector<Residuals> held_out_by_simulation(const Fitter& fitter, const Flights& flights,
                                              const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                              bool less_nuisances, int threads);

}  // namespace flappy::gap
