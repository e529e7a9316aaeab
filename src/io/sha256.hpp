// Which bytes a file held.
#pragma once

#include <string>
#include <string_view>

namespace flappy::io {

/// SHA-256 as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace flappy::io
