// Files of a recording, from a mapping to the log.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/import/assemble.hpp"
#include "flightlog/import/sources.hpp"

namespace flappy::flightlog {

/// `warnings`: of the mapping and of the files; those of the log are in its report.
inline Imported import_files(const std::filesystem::path& mapping_file, const std::vector<std::filesystem::path>& files,
                             std::vector<std::string>& warnings) {
  warnings.clear();
  Mapping mapping = read_mapping(mapping_file);
  place_markers(mapping, warnings);
  Channels channels(mapping.wanted(), mapping.wanted_times());
  for (const auto& file : files) read_source(file, channels, warnings);
  return assemble(channels, mapping);
}

}  // namespace flappy::flightlog
