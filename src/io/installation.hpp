// Finds the files that belong to a program: in a build and its source folder, or under the prefix of an installation.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::io {

/// The path of `name` below the parent folder of the running program's bin/.
std::filesystem::path beside_program(const std::filesystem::path& name);

/// The folder of the project's configurations: $FLAPPY_CONFIGS, else configs/ beside the Python module that holds this code, else
/// share/flappy/configs of an installation or a build.
std::filesystem::path configs_folder();

/// The path of one of these configurations, for example "vehicles/hummingbird_nominal.toml".
std::string config_path(const std::string& name);

/// The path itself; but of configs/X, if there is none, the project's X.
std::filesystem::path shipped(const std::filesystem::path& path);

}  // namespace flappy::io
