// Plugins: shared libraries that are loaded at first use, because their dependencies are slow to start.
#pragma once

#include <string>

namespace flappy::io {

/// Whether this build or installation has the plugin lib/flappy/`name`.so.
bool has_plugin(const std::string& name);
/// The address of `symbol` in a plugin, which is never unloaded. InputError: `missing` without one, else the reason.
const void* plugin_symbol(const std::string& name, const char* symbol, const std::string& missing);

template <class Functions>
const Functions* plugin(const std::string& name, const char* symbol, const std::string& missing) {
  return static_cast<const Functions*>(plugin_symbol(name, symbol, missing));
}

}  // namespace flappy::io
