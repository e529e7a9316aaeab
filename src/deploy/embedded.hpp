// C sources of src/deploy that this program writes or compiles, embedded when it is built.
#pragma once

#include <map>
#include <string_view>

namespace flappy::deploy {

/// [file name without folder] text of the file.
extern const std::map<std::string_view, std::string_view> kEmbedded;

}  // namespace flappy::deploy
