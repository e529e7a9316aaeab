// Text made of numbers.
#pragma once

#include <string>

namespace flappy::io {

/// As printf, of any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

}  // namespace flappy::io
