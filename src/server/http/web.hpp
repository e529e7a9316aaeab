// The files of the dashboard's page, as they stand in src/server/http/web, and what it shares with src/view/web: put into the program when it is built.
#pragma once

#include <map>
#include <string_view>

namespace flappy::server {

/// Text by the file's name.
extern const std::map<std::string_view, std::string_view> kWeb;

}  // namespace flappy::server
