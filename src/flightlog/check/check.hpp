// Checks whether a flight log agrees with its own header: rates, dropouts, clocks, axes and units. The checks use the
// log alone, no model of the vehicle and no diagnosis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/stream_statistics.hpp"

namespace flappy::flightlog {

enum class Verdict { ok, warning, not_tested };

/// The first place of a fault in the data: a file of the log and its line.
struct LogPlace {
  std::string file;  ///< empty: no fault of the data
  std::size_t line = 2;
};

struct Finding {
  std::string check;
  Verdict verdict = Verdict::ok;
  std::string text;  ///< what was seen; in a warning also what was expected and the likely cause
  std::vector<std::pair<std::string, double>> values;  ///< the numbers on which the verdict rests
  LogPlace fault = {};  ///< set where a warning forbids a diagnosis, because no physics explains it
};

struct CheckReport {
  std::vector<StreamStatistics> streams;
  std::vector<Finding> findings;
  std::size_t count(Verdict verdict) const;
};

CheckReport check_flight(const FlightLog& log);

/// One report for each flight. Flights that declare the same inputs are compared in their findings "input NAME".
std::vector<CheckReport> check_flights(const std::vector<FlightLog>& logs);

}  // namespace flappy::flightlog
