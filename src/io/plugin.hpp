// A part of the project that is opened when it is first asked for, as what it needs is slow to start.
#pragma once

#include <string>

namespace flappy::io {

/// Whether this build or installation has the plugin lib/flappy/`name`.so.
bool has_plugin(const std::string& name);
/// What it exports under the name `symbol`; never unloaded. InputError: `missing` without the plugin, or what is wrong with it.
const void* plugin_symbol(const std::string& name, const char* symbol, const std::string& missing);

template <class Functions>
const Functions* plugin(const std::string& name, const char* symbol, const std::string& missing) {
  return static_cast<const Functions*>(plugin_symbol(name, symbol, missing));
}

}  // namespace flappy::io
