// Formatting of text for people.
#pragma once

#include <string>
#include <string_view>

namespace flappy::io {

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Replaces control characters and bytes that are not UTF-8 by \xNN, to show foreign text and write it as JSON.
std::string printable(std::string_view text);

/// printable() of at most `limit` bytes, with "..." where the text was cut.
std::string shortened(std::string_view text, std::size_t limit = 60);

}  // namespace flappy::io
