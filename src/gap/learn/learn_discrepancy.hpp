// Learns the model discrepancy from trusted robots: their flights contain nothing that the vehicle file lacks.
#pragma once

#include <string>
#include <vector>

#include "gap/fit/robot_fit.hpp"

namespace flappy::gap {

/// Prior standard deviations of coefficients, by channel, harmonic and kind, and of background magnitudes that make all
/// residuals most probable: each robot is fitted, then expectation-maximisation runs from `start`, whose other
/// parameters stay. Estimates are shrunk towards like ones, as each rests on few coefficients. `flights`: [robot].
/// io::InputError after Ctrl-C.
ModelDiscrepancy learn_discrepancy(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                   const ModelDiscrepancy& start, int threads);

/// Two sessions of a robot.
struct SessionPair {
  Flights flights;
  std::string effect;  ///< effect of the catalogue that appeared between them; empty: none
};

/// Learns what differs between sessions from pairs in which nothing that matters changed, and how far laws of one cause
/// differ from pairs with an effect, if there are enough. What cannot be learnt stays as in `start`.
/// io::InputError after Ctrl-C.
SessionVariation learn_sessions(const std::vector<SessionPair>& pairs, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& start, int threads);

}  // namespace flappy::gap
