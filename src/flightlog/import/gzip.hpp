#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

bool is_gzip(std::string_view bytes);

/// The uncompressed content. A damaged file is read up to the damage, with a warning that begins with `name`.
/// InputError where nothing can be read.
std::string gunzipped(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
