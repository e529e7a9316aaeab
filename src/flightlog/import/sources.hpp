// What may be imported: rosbag2's bags (MCAP, SQLite), PX4's ULog, CSV.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Reads a file, or a bag's folder, whatever of these it is; any other is a CSV, plain or made smaller by gzip, whose channel is the
/// stem of its name and whose rows have no time but what their fields say: cells that are empty or "nan" are missing. `warnings`: what was left out. InputError where it cannot be read.
void read_source(const std::filesystem::path& file, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
