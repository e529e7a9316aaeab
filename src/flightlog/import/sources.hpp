#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Reads a bag (MCAP, SQLite; file or folder), a ULog, a usdlog, a log of ArduPilot, a MATLAB file, a C3D, or any other
/// text as a table (table.hpp) into the channel named by the file's stem; all but bags and MATLAB files may be gzipped.
/// Warns of everything left out. InputError where the file cannot be read; for a known foreign format it names the
/// command that converts it.
void read_source(const std::filesystem::path& file, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
