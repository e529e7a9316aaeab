// Residuals in held-out flights: each test flight is predicted by a fit to other flights. Flights that are held out
// together are a fold; `fold` is [test flight] the number of its fold, from 0 on.
#pragma once

#include <vector>

#include "gap/fit/fit.hpp"

namespace flappy::gap {

/// A hypothesis, and its fit to all flights.
struct FittedHypothesis {
  Hypothesis hypothesis;
  const Fit* fit;  ///< not owned
};

/// [fold][flight] Whether a fit that predicts the fold may use the flight: all references, and tests of other folds. If
/// there is only one fold, its fit uses all flights.
std::vector<std::vector<char>> others_of(const Flights& flights, const std::vector<int>& fold);

/// [fit] Question::held_out for flights without references. For each fold, each fit is adapted to the other folds by
/// its columns (Fitter::joint_fit), and the vehicle at the result is simulated. The residual of a flight is empty if
/// that simulation diverges. `less_nuisances`: whether to subtract what nuisance regressors explain in the adapted fit.
std::vector<TestResiduals> held_out_by_simulation(const Fitter& fitter, const Flights& flights,
                                                  const std::vector<FittedHypothesis>& fits,
                                                  const std::vector<int>& fold, bool less_nuisances, int threads);

}  // namespace flappy::gap
