// What vehicles leave of the measured rows of flights.
#pragma once

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Rows of all flights, [flight].
using Residuals = std::vector<Rows>;

/// Measured less predicted rows for each vehicle; empty for a vehicle that comes apart. Effects of sensors are undone in the logs. `threads`: as
/// for io::parallel_for.
std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads);

}  // namespace flappy::gap
