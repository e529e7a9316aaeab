// Says how well a vehicle predicts test flights that its fits have not seen. The diagnosis of a beat-averaged vehicle
// reports this as its validation, and decide() refutes hypotheses by mean_square(). Only means of beats count, no
// harmonics.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// [test flight] The residual less the part that functions of the regime explain (gap/evidence/evidence.hpp), by least
/// squares with a small ridge. Each flight is explained by a fit to the other test flights, a lone flight by a fit to
/// itself. The rest estimates what no law of the regime can explain. `residual`: [test flight]; an empty flight stays
/// empty.
TestResiduals smoothed_away(const Evidence& evidence, const Flights& flights, const TestResiduals& residual);
/// Mean square of the beat means over all channels and flights, in units of the noise variance. `residual`: [test
/// flight]; empty flights do not count. 0 if none counts.
double mean_square(const Evidence& evidence, const FlightList& tests, const TestResiduals& residual);

/// Smallest shift in time of a copy of an effect's change, in rows; in a flight of fewer than four times as many rows,
/// a quarter of its rows. Choice: longer than the motion of a flight stays correlated.
inline constexpr std::size_t kMinShift = 50;

/// The largest share of the rms of `y` that one of kCopies copies of `x` removes. A copy has each flight rotated
/// cyclically in time by a random number of rows, at least kMinShift. The factor of a copy is fitted like that of an
/// effect: to the other flights, or to a lone flight itself. `y`: what an effect may explain; `x`: what the effect
/// changes; both [flight][row], with two rows or more in each flight, and mean 0 over all flights.
double best_of_shifted(const std::vector<std::vector<double>>& y, const std::vector<std::vector<double>>& x);

/// The validation of a diagnosis; Question::validate of BeatAveraged calls it. `flights`: without references.
///   ladder      rms of the residual in each channel: of the vehicle file, then of the fitted parameters, then with one
///               more concluded effect on each rung, as far as these sets were fitted
///   controls    for each effect of the last rung: what its change removes from the residual without it, and what
///               copies of this change remove (best_of_shifted), in the channel where the effect removes most. Flights
///               with a single row of a channel do not count there.
///   agreements  each magnitude of the last rung, estimated from each flight alone
/// `question`: its held_out() also holds out all flights of a type together. `fitter`: with the scales of the
/// parameters.
Validation validation_of(const Question& question, const Fitter& fitter, const sim::Randomisation& uncertain,
                         const Flights& flights, const Inference& d, int threads);

}  // namespace flappy::gap
