#include "io/plugin.hpp"

#include <dlfcn.h>

#include "io/files.hpp"
#include "io/installation.hpp"

namespace flappy::io {
namespace {

std::filesystem::path file_of(const std::string& name) { return beside_program("lib/flappy/" + name + ".so"); }

}  // namespace

bool has_plugin(const std::string& name) { return std::filesystem::exists(file_of(name)); }

const void* plugin_symbol(const std::string& name, const char* symbol, const std::string& missing) {
  if (!has_plugin(name)) throw InputError(missing);
  void* loaded = dlopen(file_of(name).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (loaded == nullptr)
    throw InputError(file_of(name).string() + ": cannot be loaded: " + dlerror() +
                     "; accepted: the libraries that this build was made with");
  const void* found = dlsym(loaded, symbol);
  if (found == nullptr)
    throw InputError(file_of(name).string() + ": has no " + symbol + "; accepted: a plugin of this build");
  return found;
}

}  // namespace flappy::io
