// Checks names that clients send. A name selects a file below a folder: it cannot be an absolute path or an option, nor
// leave the folder by ".." or through a symbolic link.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace flappy::server {

/// Whether below() may accept the name: of letters, digits, "_", "-", "." and "/", and not too long.
bool is_name(std::string_view name);

/// The absolute path of `name` without symbolic links. Throws io::InputError, which begins with `what`, where `name` is
/// malformed or nothing of that name lies below the folder.
std::filesystem::path below(const std::filesystem::path& folder, const std::string& name, const std::string& what);

/// Throws io::InputError unless KEY=VALUE of printable ASCII whose value cannot name a file in another folder.
void check_override(const std::string& override);

}  // namespace flappy::server
