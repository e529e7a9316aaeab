// Says what makes reference flights a poor measure for test flights.
#pragma once

#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// Throws io::InputError if a stream is in flights of one set and in none of the other: what is not seen before cannot
/// change. `logs`: so many `references`, then test flights; `folders`: for messages.
void check_same_streams(const std::vector<flightlog::FlightLog>& logs, const std::vector<std::string>& folders,
                        std::size_t references);

/// One line for each thing that makes the answer less sure, with what it costs: another vehicle file, other sensors,
/// too short flights, references of one session, regimes that the references never have. `headers`: [flight].
std::vector<std::string> contrast_warnings(const std::vector<flightlog::FlightHeader>& headers, const Flights& flights);

}  // namespace flappy::gap
