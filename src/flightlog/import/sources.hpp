// What may be imported: rosbag2's bags (MCAP, SQLite), PX4's ULog, CSV.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Reads a bag, which may be a folder, a ULog or, of any other text, a table (table.hpp), whose channel is the stem of its name. Tables and ULogs may be
/// compressed by gzip. `warnings` get what was left out. InputError where the file cannot be read; of a kind that others
/// know, it says which, and what makes it readable.
void read_source(const std::filesystem::path& file, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
