// Residuals of vehicle hypotheses: measured rows less predicted rows.
#pragma once

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Rows of all flights, [flight].
using Residuals = std::vector<Rows>;

/// Residuals of each vehicle hypothesis, [vehicle][flight]; empty for a vehicle whose simulation diverges. Effects of sensors are undone in the
/// logs, except those of beat-averaged vehicles, which are part of the prediction. `threads`: as for io::parallel_for.
std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads);

}  // namespace flappy::gap
