// What a page is made of, put into the program when it is built: src/view/web, three.js and Chart.js.
#pragma once

#include <map>
#include <string_view>

namespace flappy::view {

/// Text by the file's name.
extern const std::map<std::string_view, std::string_view> kPageFiles;

}  // namespace flappy::view
