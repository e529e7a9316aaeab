// What fits leave in flights that they have not seen, and what a laboratory asks besides.
#pragma once

#include "gap/diagnose/diagnose.hpp"

namespace flappy::gap {

struct Fitted {
  Hypothesis hypothesis;
  const Linearised* point;
};

/// What is left, [fit][flight], in each flight with the fit to those of other folds; of a single fold, with its own. `fold`: of each flight.
std::vector<Residuals> held_out(const RobotFit& robot, const std::vector<PredictedFlight>& flights,
                                const std::vector<Fitted>& fits, const std::vector<int>& fold, int threads);

/// What smooth functions of the regime leave of a residual in each flight, by least squares on those of the others: as much as anything that
/// depends on the regime could explain.
Residuals smoothed_away(const RobotFit& robot, const std::vector<PredictedFlight>& flights, const Residuals& residual);
/// Mean square over all rows, in units of noise.
double mean_square(const RobotFit& robot, const std::vector<PredictedFlight>& flights, const Residuals& residual);

/// Of the most probable effects. Shifted copies are moved round within each flight by at least kLeastShift rows, and fitted as the effect is:
/// to other flights, by least squares.
inline constexpr std::size_t kLeastShift = 50;
Validation validate(const RobotFit& robot, const std::vector<PredictedFlight>& flights, const Diagnosis& diagnosis,
                    int threads);

}  // namespace flappy::gap
