// Learns the model discrepancy from robots that are trusted: their flights contain nothing that the vehicle file lacks.
#pragma once

#include <string>
#include <vector>

#include "gap/evidence/robot_fit.hpp"

namespace flappy::gap {

/// Finds the prior standard deviations of the discrepancy coefficients, by channel, harmonic and kind of function, and of the background magnitudes
/// that make the residuals of all robots most probable: expectation-maximisation from `start` on, whose other parameters stay. Each robot is fitted
/// first. At the end, estimates are shrunk towards those of like channels and effects, for single estimates rest on few coefficients. `flights`:
/// [robot]. io::InputError after Ctrl-C.
ModelDiscrepancy learn_discrepancy(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                   const ModelDiscrepancy& start, int threads);

}  // namespace flappy::gap
