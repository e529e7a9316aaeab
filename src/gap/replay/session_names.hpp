// Which session each flight is of.
#pragma once

#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// PredictedFlight::session() of each flight.
std::vector<std::string> session_names(const FlightList& flights);

/// [flight] Number of its session, from 0 on. Flights that name the same session share a number; each flight without a
/// name is a session of its own.
std::vector<int> session_numbers(const std::vector<std::string>& names);

}  // namespace flappy::gap
