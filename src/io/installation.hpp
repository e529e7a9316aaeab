// Finds the files that belong to a program: in a build and its source folder, or under the prefix of an installation.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::io {

/// The path of `name` below the parent folder of the running program's bin/.
std::filesystem::path beside_program(const std::filesystem::path& name);

/// The folder of the project's configurations: $FLAPPY_CONFIGS, else share/flappy/configs of an installation, else
/// configs/ next to the library that holds this code, else that of the source folder.
std::filesystem::path configs_folder();

/// The path of one of these configurations, for example "vehicles/hummingbird_nominal.toml".
std::string config_path(const std::string& name);

}  // namespace flappy::io
