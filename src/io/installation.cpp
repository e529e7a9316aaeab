#include "io/installation.hpp"

#include <dlfcn.h>

#include <cstdlib>

namespace flappy::io {

namespace fs = std::filesystem;
namespace {

/// configs/ next to the library that contains this code, where a Python package has it.
fs::path beside_library() {
  Dl_info library;
  if (dladdr(reinterpret_cast<void*>(&beside_library), &library) == 0) return {};
  return fs::path(library.dli_fname).parent_path() / "configs";
}

}  // namespace

fs::path beside_program(const fs::path& name) {
  std::error_code none;
  return fs::read_symlink("/proc/self/exe", none).parent_path().parent_path() / name;
}

fs::path configs_folder() {
  if (const char* chosen = std::getenv("FLAPPY_CONFIGS"); chosen != nullptr && *chosen != '\0') return chosen;
  const fs::path installed = beside_program("share/flappy/configs");
  std::error_code none;
  for (const fs::path& place : {installed, beside_library()})
    if (fs::is_directory(place, none)) return place;
  return FLAPPY_SOURCE_CONFIGS;
}

std::string config_path(const std::string& name) { return configs_folder() / name; }

}  // namespace flappy::io
