// C sources that this program writes or compiles, as they stand in src/deploy: put into it when it is built.
#pragma once

#include <map>
#include <string_view>

namespace flappy::deploy {

/// Text by the file's name, without folder.
extern const std::map<std::string_view, std::string_view> kEmbedded;

}  // namespace flappy::deploy
