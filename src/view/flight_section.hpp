// The section of recorded flights: the robot in 3D next to plots of its streams.
//
// The block "flights": {"goal_m": [x, y, z] | null, "flights": [{"name", "flapping_Hz", "gravity_m_s2", "vehicle",
// "ambient", "wings": "recorded" | "derived" | "still" | "none", "latency_s": {stream: declared}, "streams": {stream:
// {column: packed}}, "swapped": {"begin_s": packed, "end_s": packed} | null, "notes": [...]}]}.
// Columns are those of the log (flightlog/flight_log.hpp), rounded well below sensor noise, at most kMaxSamples long.
// Declared inputs form the stream "declared" instead of "command". "vehicle" is its drawn form (shape.hpp). Flights of
// a beat-averaged vehicle have a stream "path": the specific force of the path that motion capture saw
// (flightlog/beat_averaged_motion.hpp), at the times of that motion. "mocap" has no poses with swapped markers
// (flightlog/readings.hpp); "swapped" has the first and last time of each stretch of them. truth.csv is not read.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "view/page.hpp"

namespace flappy::view {

inline constexpr std::size_t kMaxSamples = 600'000;  ///< of a stream: ten minutes of a driver's milliseconds
inline constexpr std::size_t kMaxFlights = 8;

struct FlightOptions {
  std::filesystem::path vehicle;  ///< for flights whose folder has none; empty: the shipped vehicle of that name
  std::optional<std::array<double, 3>> goal_m;  ///< in W
};

struct ShownFlight {
  std::string name;
  std::filesystem::path folder;  ///< first place to look for its vehicle, and the source that the page names
  flightlog::FlightLog log;
};

/// Throws io::InputError where a vehicle is not found, and for more than kMaxFlights flights.
Section flight_section(std::vector<ShownFlight> flights, const FlightOptions& options, Packing& packing);

/// Reads the logs in `folders`, named by their folders. Also throws io::InputError for a log that cannot be read.
Section flight_section(const std::vector<std::filesystem::path>& folders, const FlightOptions& options,
                       Packing& packing);

}  // namespace flappy::view
