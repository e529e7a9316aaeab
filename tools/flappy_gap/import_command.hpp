// flappy-gap import: what others recorded, as a flight log.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace flappy::gap {

struct ImportCommand {
  std::vector<std::filesystem::path> files;
  std::filesystem::path mapping, out;
  std::vector<std::string> overrides;
};

/// Writes the flight log and prints what came late, twice or never; InputError before anything is written.
nlohmann::ordered_json run_import(const ImportCommand& command);

}  // namespace flappy::gap
