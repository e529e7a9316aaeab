#pragma once

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Rows of all flights, [flight].
using Residuals = std::vector<Rows>;

/// Measured less predicted rows, [vehicle][flight]; empty for a vehicle whose simulation diverges. Effects of sensors
/// are undone in the logs, except for beat-averaged vehicles, which predict them. `threads`: as for io::parallel_for.
/// Reference flights are predicted without the effects of a vehicle.
std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads);
/// Those of the test flights alone.
Residuals tests_of(const Flights& flights, Residuals residual);

}  // namespace flappy::gap
