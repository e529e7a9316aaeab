// Makes a flight log from channels by a mapping.
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
  std::size_t samples = 0;                          ///< samples in the log
  std::size_t twice = 0;                            ///< samples at the time of another one, dropped
  std::size_t unusable = 0;                         ///< faulty samples, dropped
  std::map<std::string, std::size_t> why_unusable;  ///< counts by reason, as "lacks x_m"
  std::size_t late = 0, reordered = 0;              ///< samples that came late or out of order; kept
  std::size_t lost = 0;                             ///< samples that never came, by `sequence` or by the rate
  double rate_hz = 0;                               ///< measured
  /// Delay beyond that of the quickest message of the same clock; 0 without times of receipt.
  double delay_median_s = 0, delay_most_s = 0;
  std::vector<double>
      residual_m;  ///< [sample] rms distance of the markers from their places in the pose, m; without markers empty
  std::vector<double> deviation_rad;  ///< [sample] of wings by points: the larger deviation of the two wings
  double stroke_noise_rad = 0;        ///< FilmedWings::stroke_noise_rad; 0 without points
};

struct ClockReport {
  std::string name;
  double offset_s = 0;    ///< receiver's time less this clock's time, at the first stamp
  double drift = 0;       ///< seconds that the receiver's clock gains per second
  bool measured = false;  ///< whether from stamps and times of receipt; else the mapping gives the offset
  std::size_t stamps = 0;
  double span_s = 0;
};

struct ImportReport {
  std::int64_t start_ns = 0;  ///< time of the log's 0 s on the receiver's clock
  std::vector<StreamReport> streams;
  std::vector<ClockReport> clocks;
  std::vector<std::string> warnings;  ///< samples left out, and optional streams that were not recorded
};

struct Imported {
  FlightLog log;
  ImportReport report;
};

/// InputError, at the mapping's line, for a channel or field not recorded and for undeterminable times. Validates
/// nothing else: write_flight_log() does.
Imported assemble(const Channels& channels, const Mapping& mapping);

/// Finds the places of markers in B where the mapping has a recording at rest. InputError for a marker that is not in it.
void place_markers(Mapping& mapping, std::vector<std::string>& warnings);

/// Reads a recording's files (sources.hpp), logs warnings and writes the log to `out`; after InputError, nothing.
Imported import_recording(const std::vector<std::filesystem::path>& files, const Mapping& mapping,
                          const std::filesystem::path& out);

/// The report as --json prints it.
nlohmann::ordered_json json_of(const ImportReport& report);

/// The report as text: a table of the streams and a line for each clock.
std::string report_text(const ImportReport& report);

}  // namespace flappy::flightlog
