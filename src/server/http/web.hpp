// The dashboard's files (src/server/http/web and parts of src/view/web), embedded in the program when it is built.
#pragma once

#include <map>
#include <string_view>

namespace flappy::server {

extern const std::map<std::string_view, std::string_view> kWeb;  ///< [file name] text of the file

}  // namespace flappy::server
