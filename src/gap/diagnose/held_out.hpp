// Residuals in held-out flights: each flight is predicted by a fit to other flights.
#pragma once

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

struct FittedHypothesis {
  Hypothesis hypothesis;
  const Fit* fit;
};

/// Residuals, [fit][test flight], of predictions by the fit to the other folds, or to all flights if there is one fold.
/// `fold`: [test flight]; references are never held out.
std::vector<Residuals> held_out(const Fitter& fitter, const Flights& flights, const std::vector<FittedHypothesis>& fits,
                                const std::vector<int>& fold, int threads);

/// Sets d.refit, and `held_out` of each fitted hypothesis; each test flight is a fold.
void hold_out(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights, int threads,
              Inference& d);

/// Residuals of the test flights less the functions of the regime that are fitted to the other ones by least squares:
/// estimates what is left once all that depends on the regime is explained.
Residuals smoothed_away(const Evidence& evidence, const Flights& flights, const Residuals& residual);
/// Mean square of the beat means over all channels, in units of the noise variance.
double mean_square(const Evidence& evidence, const FlightList& tests, const Residuals& residual);

/// Ladder, controls and agreements of the concluded effects. For the controls, an effect's contribution is rotated in
/// time by kMinShift rows or more within each flight, and fitted like the effect to the other flights.
inline constexpr std::size_t kMinShift = 50;
Validation validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                    const Inference& d, int threads);

}  // namespace flappy::gap
