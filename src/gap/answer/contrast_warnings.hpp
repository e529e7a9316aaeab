// Says what makes reference flights a poor measure for test flights.
#pragma once

#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Throws io::InputError if a stream is in some references and in no test flight, or the reverse: what was not seen
/// before cannot change. `logs`: first `references` reference flights, then test flights; `folders`: [log], for
/// messages.
void check_same_streams(const std::vector<flightlog::FlightLog>& logs, const std::vector<std::string>& folders,
                        std::size_t references);

/// Returns a line for each thing that makes the answer less sure, and says in it what that costs: vehicle files or
/// sensors that differ, flights that are too short, references of one session alone, regimes of the tests that the
/// references never have. `headers`: [flight].
std::vector<std::string> contrast_warnings(const std::vector<flightlog::FlightHeader>& headers, const Flights& flights);

}  // namespace flappy::gap
