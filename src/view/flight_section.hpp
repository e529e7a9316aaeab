// Recorded flights as a page shows them: the robot in 3D and its streams, one beside the others.
//
// The block "flights": {"goal_m": [x, y, z] | null, "flights": [{"name", "flapping_Hz", "gravity_m_s2", "vehicle", "ambient",
// "wings": "recorded" | "derived" | "still" | "none", "latency_s": {stream: declared}, "streams": {stream: {column: packed}},
// "swapped": {"begin_s": packed, "end_s": packed} | null, "notes": [...]}]}.
// Columns are those of the log (flightlog/flight_log.hpp), rounded well below any sensor's noise; no stream has more than kMostSamples, so
// that flights of any length open. Declared inputs are the stream "declared" in place of "command". "vehicle" is its shape (shape.hpp). Flights
// of one that is known by the beat have a stream "path": the specific force of the path that motion capture saw (flightlog/mean_motion.hpp),
// at its instants. Poses whose markers were taken for others (flightlog/readings.hpp) are left out of "mocap"; "swapped" has the times of the
// first and the last of each stretch of them. truth.csv is not read.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "view/page.hpp"

namespace flappy::view {

inline constexpr std::size_t kMostSamples = 600'000;  ///< of a stream: ten minutes of a driver's milliseconds
inline constexpr std::size_t kMostFlights = 8;

struct FlightOptions {
  std::filesystem::path vehicle;  ///< of flights whose folder has none; empty: the shipped one of that name
  std::optional<std::array<double, 3>> goal_m;  ///< in W
};

struct ShownFlight {
  std::string name;
  std::filesystem::path folder;  ///< where its vehicle is looked for first, and the source that is named
  flightlog::FlightLog log;
};

/// io::InputError of a vehicle that is nowhere, more than kMostFlights.
Section flight_section(std::vector<ShownFlight> flights, const FlightOptions& options, Packing& packing);

/// The same of folders, by their names; io::InputError of a log that cannot be read, too.
Section flight_section(const std::vector<std::filesystem::path>& folders, const FlightOptions& options,
                       Packing& packing);

}  // namespace flappy::view
