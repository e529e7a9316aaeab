// Plugins: shared libraries that are loaded at first use, because their dependencies are slow to start.
#pragma once

#include <string>

namespace flappy::io {

/// Whether this build or installation has the plugin lib/flappy/`name`.so.
bool has_plugin(const std::string& name);
/// The address that the plugin exports as `symbol`; it is never unloaded. Throws InputError: `missing` where there is no plugin, else the reason.
const void* plugin_symbol(const std::string& name, const char* symbol, const std::string& missing);

template <class Functions>
const Functions* plugin(const std::string& name, const char* symbol, const std::string& missing) {
  return static_cast<const Functions*>(plugin_symbol(name, symbol, missing));
}

}  // namespace flappy::io
