// Prepares a recorded flight for predictions by vehicles of one kind: ResetPrediction for vehicles with wings and
// motors, BeatAveragedPrediction for beat-averaged vehicles.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// `vehicle`: the vehicle that is believed to have flown. `folder`: folder of the log. `channels`: for a beat-averaged
/// vehicle, the only channels that get rows; empty: all that it compares. Not used for a vehicle with wings. Errors are
/// those of the two classes: io::InputError for a log that the vehicle cannot have flown; for a beat-averaged vehicle
/// also flightlog::TooLittleSeen if the flight is too short.
std::shared_ptr<PredictedFlight> prediction_of(const model::Vehicle& vehicle, const std::filesystem::path& folder,
                                               flightlog::FlightLog log, const std::vector<int>& channels = {});

}  // namespace flappy::gap
