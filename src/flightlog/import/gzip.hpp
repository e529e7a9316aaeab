// Files that gzip made smaller.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

/// Whether a file begins as one.
bool is_gzip(std::string_view bytes);

/// What was made smaller. A file that ends early or is damaged is read as far as it goes, with a warning that names it. InputError
/// where nothing of it can be read.
std::string gunzipped(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
