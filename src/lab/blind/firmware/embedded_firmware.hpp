// The firmware's C source, embedded when this program is built.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace flappy::blind {

/// [file name] text of the file.
extern const std::map<std::string_view, std::string_view> kFirmware;

}  // namespace flappy::blind
