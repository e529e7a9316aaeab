// What fits leave in flights that they have not seen.
#pragma once

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

struct FittedHypothesis {
  Hypothesis hypothesis;
  const Fit* fit;
};

/// Residuals, [fit][flight], of each flight with the fit to those of other folds; of a single fold, with the fit to all. `fold`: [flight].
std::vector<Residuals> held_out(const Fitter& fitter, const Flights& flights, const std::vector<FittedHypothesis>& fits,
                                const std::vector<int>& fold, int threads);

/// Sets d.refit, and held_out of each fitted hypothesis, each flight being a fold.
void hold_out(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights, int threads,
              Inference& d);

/// A residual less, in each flight, the smooth functions of the regime that fit the other flights by least squares: no effect can explain more.
Residuals smoothed_away(const Evidence& evidence, const Flights& flights, const Residuals& residual);
/// Mean square over all rows, in units of noise.
double mean_square(const Evidence& evidence, const Flights& flights, const Residuals& residual);

/// Controls of the most probable effects. Shifted copies are rotated within each flight by kMinShift rows or more, and fitted like the effect: to
/// other flights, by least squares.
inline constexpr std::size_t kMinShift = 50;
Validation validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                    const Inference& d, int threads);

}  // namespace flappy::gap
