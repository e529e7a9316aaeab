#include "io/installation.hpp"

#include <cstdlib>

namespace flappy::io {

namespace fs = std::filesystem;

fs::path beside_program(const fs::path& name) {
  std::error_code none;
  return fs::read_symlink("/proc/self/exe", none).parent_path().parent_path() / name;
}

fs::path configs_folder() {
  if (const char* chosen = std::getenv("FLAPPY_CONFIGS"); chosen != nullptr && *chosen != '\0') return chosen;
  const fs::path installed = beside_program("share/flappy/configs");
  std::error_code none;
  return fs::is_directory(installed, none) ? installed : fs::path(FLAPPY_SOURCE_CONFIGS);
}

std::string config_path(const std::string& name) { return configs_folder() / name; }

}  // namespace flappy::io
