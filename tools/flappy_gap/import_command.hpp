// flappy-gap import: converts recordings of other programs into a flight log.
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

/// Writes the flight log and prints the messages that came late, twice or never. Throws InputError before it writes anything.
nlohmann::ordered_json run_import(const ImportCommand& command);

}  // namespace flappy::gap
