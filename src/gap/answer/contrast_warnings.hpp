// Says what makes reference flights a poor measure for test flights.
#pragma once

#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Throws io::InputError if the flights do not have the same streams. `logs`: references, then test flights; `folders`:
/// for messages.
void check_same_streams(const std::vector<flightlog::FlightLog>& logs, const std::vector<std::string>& folders);

/// One line for each thing that makes the answer less sure, with what it costs: another vehicle file, other sensors,
/// too short flights, references of one session, regimes that the references never have. `headers`: [flight].
std::vector<std::string> contrast_warnings(const std::vector<flightlog::FlightHeader>& headers, const Flights& flights);

}  // namespace flappy::gap
