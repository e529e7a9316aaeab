// The sources around the exported headers that make them an app of a known firmware.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// Names of the firmwares that firmware_files() knows.
inline constexpr const char* kFirmwares[] = {"crazyflie", "px4"};

/// Whether the folder is an app that firmware_files() made for `firmware`.
bool is_app(const std::filesystem::path& folder, const std::string& firmware);

/// [path below the app's folder] text of an out-of-tree app for `firmware`, its log's configuration and mapping; `headers`
/// are flappy_policy.h and flappy_controller.h. io::InputError where the vehicle is none for this firmware, or the task's
/// actions move an input further than it can.
std::map<std::string, std::string> firmware_files(const std::string& firmware, const rollout::FlyConfig& config,
                                                  const std::map<std::string, std::string>& headers);

}  // namespace flappy::deploy
