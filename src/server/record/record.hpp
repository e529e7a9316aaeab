// Records a robot's ROS 2 topics into a flight log: writes the messages unchanged to an MCAP file, then imports that by
// the mapping (docs/reference/import.md), which names the topics. A topic's type is the one that its writer announces.
// After a kill, the file is readable up to about its last second, and `flappy-gap import` makes the log from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "flightlog/import/assemble.hpp"
#include "io/dds_config.hpp"

namespace flappy::server {

struct RecordOptions {
  std::filesystem::path out;  ///< folder of the flight log; the messages go to out.mcap
  double duration_s = 0;      ///< 0: until keep_going returns false
  /// Called about ten times a second with the number of messages of each topic; false ends the recording.
  std::function<bool(const std::map<std::string, std::uint64_t>& messages)> keep_going;
};

struct Recorded {
  std::filesystem::path mcap;
  std::map<std::string, std::uint64_t> messages;  ///< number for each topic that was heard
  std::uint64_t refused = 0;                      ///< messages longer than kMaxBytes
  flightlog::ImportReport report;
};

/// Longer messages are refused: no sensor sample is that long.
inline constexpr std::size_t kMaxBytes = 65'536;

/// Throws InputError where a type is not supported or the messages make no flight log; the MCAP file stays.
Recorded record(const io::DdsConfig& dds, const flightlog::Mapping& mapping, const RecordOptions& options);

}  // namespace flappy::server
