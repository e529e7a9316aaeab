// Where a program finds what lies beside it: in a build and its source folder, or under the prefix of an installation.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::io {

/// `name` under the folder that holds the running program's bin/.
std::filesystem::path beside_program(const std::filesystem::path& name);

/// The project's own configurations: the folder that the environment variable FLAPPY_CONFIGS names, else
/// share/flappy/configs of an installation, else configs/ beside the library that holds this code, else that of the source folder.
std::filesystem::path configs_folder();

/// One of them, as "vehicles/hummingbird_nominal.toml".
std::string config_path(const std::string& name);

}  // namespace flappy::io
