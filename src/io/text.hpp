// Text for people.
#pragma once

#include <string>
#include <string_view>

namespace flappy::io {

/// As printf, of any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// The text with control characters, and bytes that are no UTF-8, as \xNN: what strangers' files hold may be shown, and written as JSON.
std::string printable(std::string_view text);

/// The same of at most `limit` bytes, with "..." where it was cut.
std::string shortened(std::string_view text, std::size_t limit = 60);

}  // namespace flappy::io
