// Reads a file by a library that damaged files may crash, in a child process with bounds of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace flappy::flightlog {

/// Takes a piece of what the child found.
using Send = std::function<void(std::string_view)>;

/// Runs `read` in a child process and returns all that it sent. `file_size` bounds its memory and its time. InputError
/// of `name`: that of `read`; or that the file is damaged, where the child crashed or met a bound; `accepted` ends the
/// line. std::system_error where there can be no child.
std::string read_in_child(const std::string& name, std::size_t file_size, const std::string& accepted,
                          const std::function<void(const Send&)>& read);

}  // namespace flappy::flightlog
