// Learns the model discrepancy from trusted robots: their flights contain nothing that the vehicle file lacks.
#pragma once

#include <string>
#include <vector>

#include "gap/evidence/robot_fit.hpp"

namespace flappy::gap {

/// Prior standard deviations of coefficients, by channel, harmonic and kind, and of background magnitudes that make all
/// residuals most probable: each robot is fitted, then expectation-maximisation runs from `start`, whose other
/// parameters stay. Estimates are shrunk towards like ones, as each rests on few coefficients. `flights`: [robot].
/// io::InputError after Ctrl-C.
ModelDiscrepancy learn_discrepancy(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                   const ModelDiscrepancy& start, int threads);

/// Learns what differs between sessions from pairs of sessions in which nothing that matters changed. `flights`: [pair]
/// references and then test flights.
SessionVariation learn_sessions(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& start, int threads);

}  // namespace flappy::gap
