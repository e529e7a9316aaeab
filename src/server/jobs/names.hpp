// Checks names that clients send. A name selects a file below a folder and nothing else: it cannot be an absolute path or an option, and cannot
// leave the folder by ".." or through a symbolic link.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::server {

/// Returns the file or folder `name` below `folder`, as an absolute path without symbolic links. Throws io::InputError, which begins with
/// `what`, where `name` is malformed, or nothing of that name lies below the folder.
std::filesystem::path below(const std::filesystem::path& folder, const std::string& name, const std::string& what);

/// Throws io::InputError unless `override` is KEY=VALUE and its value cannot name a file in another folder: printable ASCII without slash,
/// backslash and "..".
void check_override(const std::string& override);

}  // namespace flappy::server
