// Formatting of text for people.
#pragma once

#include <string>
#include <string_view>

namespace flappy::io {

/// printf to a string of any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Replaces control characters and bytes that are not UTF-8 by \xNN, so that contents of foreign files can be shown and written as JSON.
std::string printable(std::string_view text);

/// printable() of at most `limit` bytes, with "..." where the text was cut.
std::string shortened(std::string_view text, std::size_t limit = 60);

}  // namespace flappy::io
