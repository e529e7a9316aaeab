// What flights measured less what vehicles predict, row by row: all fits and tests of a diagnosis compare by this.
#pragma once

#include <functional>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// [flight] Rows of all flights of a robot, indexed as Flights: the references first. A function whose residuals are of
/// some of the flights only, such as those of a fold, says so.
using Residuals = std::vector<Rows>;
/// [test flight] Rows of the test flights alone.
using TestResiduals = std::vector<Rows>;

/// [vehicle][flight] Measured less predicted rows. If the simulation of a vehicle diverges in any flight, its whole
/// list is empty, so [vehicle] has no flights. In test flights a vehicle has its effects; in references it has those of
/// the vehicle file (VehicleHypothesis::file_effects) in their place.
/// For vehicles with wings, effects of sensors are undone in the log; beat-averaged vehicles predict them. Residuals of
/// references are cached by the vehicle's variates, lag and sensors alone (ResidualMemo). So two vehicles with the same
/// variates must have the same parameters.
/// `threads`: as for io::parallel_for.
std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads);
/// The same, but hands over the residuals of a block of vehicles as soon as its last flight is flown, so that few are in
/// memory. Calls use(index of the vehicle, its residuals) for each vehicle, in any order, and on several threads at once.
void for_residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads,
                   const std::function<void(std::size_t, Residuals)>& use);
/// Returns `residual`, which must not be empty, without the reference flights.
TestResiduals tests_of(const Flights& flights, Residuals residual);

}  // namespace flappy::gap
