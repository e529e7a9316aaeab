// The files that a page contains, embedded in the program when it is built: src/view/web, three.js and Chart.js.
#pragma once

#include <map>
#include <string_view>

namespace flappy::view {

extern const std::map<std::string_view, std::string_view> kPageFiles;  ///< [file name] text of the file

}  // namespace flappy::view
