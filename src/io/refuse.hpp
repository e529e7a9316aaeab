// A file of the user's that is refused.
#pragma once

#include <filesystem>
#include <string>

#include "io/files.hpp"

namespace flappy::io {

[[noreturn]] inline void refuse(const std::filesystem::path& file, const std::string& what,
                                const std::string& accepted) {
  throw InputError(file.string() + ": " + what + "; accepted: " + accepted);
}

}  // namespace flappy::io
