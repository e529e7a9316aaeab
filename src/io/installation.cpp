#include "io/installation.hpp"

#include <dlfcn.h>

#include <cstdlib>

namespace flappy::io {

namespace fs = std::filesystem;
namespace {

/// The folder of the Python module that contains this code; of a program, none.
fs::path module_folder() {
  Dl_info found;
  if (dladdr(reinterpret_cast<void*>(&module_folder), &found) == 0) return {};
  const fs::path file = found.dli_fname;
  return file.extension() == ".so" ? file.parent_path() : fs::path();
}

}  // namespace

fs::path beside_program(const fs::path& name) {
  std::error_code none;
  return fs::read_symlink("/proc/self/exe", none).parent_path().parent_path() / name;
}

fs::path configs_folder() {
  if (const char* chosen = std::getenv("FLAPPY_CONFIGS"); chosen != nullptr && *chosen != '\0') return chosen;
  const fs::path module = module_folder();
  const fs::path place = module.empty() ? beside_program("share/flappy/configs") : module / "configs";
  std::error_code none;
  const fs::path real = fs::canonical(place, none);
  return none ? place : real;
}

std::string config_path(const std::string& name) { return configs_folder() / name; }

fs::path shipped(const fs::path& path) {
  std::error_code none;
  if (path.begin() == path.end() || *path.begin() != "configs" || fs::exists(path, none)) return path;
  const fs::path own = configs_folder() / path.lexically_relative("configs");
  return fs::exists(own, none) ? own : path;
}

}  // namespace flappy::io
