// Which session each flight is of.
#pragma once

#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// PredictedFlight::session() of each flight.
std::vector<std::string> session_names(const FlightList& flights);

/// Which session each flight is of, from 0 on: flights that name the same session are one, those without a name are
/// each their own.
std::vector<int> session_numbers(const std::vector<std::string>& names);

}  // namespace flappy::gap
