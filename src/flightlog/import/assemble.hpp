// From channels to a flight log, by a mapping, and what was found on the way.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/import/channels.hpp"
#include "flightlog/import/mapping.hpp"

namespace flappy::flightlog {

struct StreamReport {
  std::string stream, channel;
  std::size_t samples = 0;                          ///< in the log
  std::size_t twice = 0;                            ///< came again at the time of another: dropped
  std::size_t unusable = 0;                         ///< dropped
  std::map<std::string, std::size_t> why_unusable;  ///< counts by reason, as "lacks x_m"
  std::size_t late = 0, reordered = 0;              ///< in the log all the same
  std::size_t lost = 0;                             ///< never came, by the sequence or the rate
  double rate_hz = 0;                               ///< measured
  /// Beyond the quickest of its clock; 0 where it has no times of receipt.
  double delay_median_s = 0, delay_most_s = 0;
};

struct ClockReport {
  std::string name;
  double offset_s = 0;  ///< the receiver's time less this clock's, at the first stamp
  double drift = 0;     ///< how much faster the receiver's goes, in a second
  bool measured = false;
  std::size_t stamps = 0;
  double span_s = 0;
};

struct ImportReport {
  std::int64_t start_ns = 0;  ///< the log's 0 s by the receiver's clock
  std::vector<StreamReport> streams;
  std::vector<ClockReport> clocks;
  std::vector<std::string> warnings;  ///< of what was left out, and of power, wings and attitude that are not recorded
};

struct Imported {
  FlightLog log;
  ImportReport report;
};

/// InputError, at the mapping's own line, for a channel or a field that is not there and for times that cannot be had. The log
/// is one that write_flight_log() looks at once more.
Imported assemble(const Channels& channels, const Mapping& mapping);

/// Reads the files of one recording (sources.hpp), notes its warnings and writes its flight log; InputError before anything is written.
Imported import_recording(const std::vector<std::filesystem::path>& files, const Mapping& mapping,
                          const std::filesystem::path& out);

/// What --json holds.
nlohmann::ordered_json json_of(const ImportReport& report);

/// A table, and a line for each clock.
std::string report_text(const ImportReport& report);

}  // namespace flappy::flightlog
