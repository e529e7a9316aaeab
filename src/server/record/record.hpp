// From a robot's ROS 2 topics to a flight log: the messages as they come go to an MCAP file, and at the end that is imported by the
// mapping (docs/import.md), which names the topics.
//
// A message is known by the type that its writer announces. The file is readable up to its last second or so, whatever ends us;
// then `flappy-gap import` makes the log.
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
  std::filesystem::path out;  ///< folder of the log; the messages go beside it, to out.mcap
  double duration_s = 0;      ///< 0: until it is interrupted
  /// Asked some ten times a second, with the messages of each topic so far; false ends the recording.
  std::function<bool(const std::map<std::string, std::uint64_t>& messages)> keep_going;
};

struct Recorded {
  std::filesystem::path mcap;
  std::map<std::string, std::uint64_t> messages;  ///< of each topic that was heard
  std::uint64_t refused = 0;                      ///< messages longer than kMostBytes
  flightlog::ImportReport report;
};

/// What a sample of a sensor never has.
inline constexpr std::size_t kMostBytes = 65'536;

/// InputError where a topic has a type that is not known here, or the messages make no flight log; the MCAP file stays.
Recorded record(const io::DdsConfig& dds, const flightlog::Mapping& mapping, const RecordOptions& options);

}  // namespace flappy::server
