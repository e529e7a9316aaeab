// Reads files that gzip compressed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

/// Whether `bytes` begin like a gzip file.
bool is_gzip(std::string_view bytes);

/// The uncompressed content. A file that ends early or is damaged is read up to there, with a warning that begins with
/// `name`. InputError where nothing can be read.
std::string gunzipped(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
