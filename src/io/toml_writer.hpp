// Writes TOML.
#pragma once

#include <string>
#include <string_view>

namespace flappy::io {

/// A string in double quotes, escaped; UTF-8 stays as it is.
std::string toml_string(std::string_view text);

std::string toml_number(double value);  ///< shortest digits that read back as the same double

bool is_bare(std::string_view key);  ///< whether it needs no quotes

/// The dotted path of a key below `path`, quoted where necessary.
std::string toml_path(const std::string& path, std::string_view key);

}  // namespace flappy::io
