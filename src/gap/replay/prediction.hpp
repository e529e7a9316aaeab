// The prediction of a flight for its kind of vehicle.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// `folder`: of the log. `channels`: of a beat-averaged vehicle, the only ones with rows; empty: all that it compares.
/// io::InputError naming `folder` for a log that the vehicle cannot have flown.
std::shared_ptr<PredictedFlight> prediction_of(const model::Vehicle& vehicle, const std::filesystem::path& folder,
                                               flightlog::FlightLog log, const std::vector<int>& channels = {});

}  // namespace flappy::gap
