// Reads the formats that can be imported: rosbag2's bags (MCAP, SQLite), PX4's ULog, CSV.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Reads a bag (a file or a folder), a ULog, or any other text as a table (table.hpp) into the channel named by the
/// stem of the file. Tables and ULogs may be compressed by gzip. Adds a warning for everything left out. InputError
/// where the file cannot be read; for a known foreign format it names the format and the command that converts it.
void read_source(const std::filesystem::path& file, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
