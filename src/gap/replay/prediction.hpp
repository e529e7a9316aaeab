// Makes a recorded flight one that vehicles of its kind can predict: ResetPrediction for vehicles with wings and
// motors, BeatAveragedPrediction for beat-averaged ones.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// `vehicle`: the one that is believed to have flown. `folder`: of the log. `channels`: of a beat-averaged vehicle, the
/// only ones with rows; empty: all that it compares; not used for one with wings. io::InputError as from the classes:
/// for a log that the vehicle cannot have flown; of a beat-averaged vehicle flightlog::TooLittleSeen for too short a
/// flight.
std::shared_ptr<PredictedFlight> prediction_of(const model::Vehicle& vehicle, const std::filesystem::path& folder,
                                               flightlog::FlightLog log, const std::vector<int>& channels = {});

}  // namespace flappy::gap
