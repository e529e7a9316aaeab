// How well flights that were held out are predicted.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Residuals of the test flights less the functions of the regime that are fitted to the other ones by least squares:
/// estimates what is left once all that depends on the regime is explained.
Residuals smoothed_away(const Evidence& evidence, const Flights& flights, const Residuals& residual);
/// Mean square of the beat means over all channels, in units of the noise variance.
double mean_square(const Evidence& evidence, const FlightList& tests, const Residuals& residual);

/// Least shift of an effect's change in its controls, in rows. Choice.
inline constexpr std::size_t kMinShift = 50;

/// Ladder, controls and agreements of the concluded effects. For the controls, an effect's contribution is rotated in
/// time by kMinShift rows or more within each flight, and fitted like the effect to the other flights.
Validation validation_of(const Question& question, const Fitter& fitter, const sim::Randomisation& uncertain,
                         const Flights& flights, const Inference& d, int threads);

}  // namespace flappy::gap
