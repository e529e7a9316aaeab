// Is a flight log what it declares to be? Rates, dropouts, clocks, axes and units, judged from the log alone: no model
// of the vehicle, no diagnosis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/stream_statistics.hpp"

namespace flappy::flightlog {

enum class Verdict { ok, warning, not_tested };

/// Where a fault of the data first shows: a file of the log and its line.
struct LogPlace {
  std::string file;  ///< empty: no such fault
  std::size_t line = 2;
};

struct Finding {
  std::string check;
  Verdict verdict = Verdict::ok;
  std::string text;  ///< what was seen; of a warning also what was expected and the likely cause
  std::vector<std::pair<std::string, double>> values;  ///< the figures behind it
  LogPlace fault = {};  ///< of a warning that forbids a diagnosis: no physics explains it
};

struct CheckReport {
  std::vector<StreamStatistics> streams;
  std::vector<Finding> findings;
  std::size_t count(Verdict verdict) const;
};

CheckReport check_flight(const FlightLog& log);

/// The same of several flights of one robot, whose declared inputs are also compared with one another.
std::vector<CheckReport> check_flights(const std::vector<FlightLog>& logs);

}  // namespace flappy::flightlog
