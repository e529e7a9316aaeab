// The sources around the exported headers that make them an app of a known firmware.
#pragma once

#include <map>
#include <string>

#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// Names of the firmwares that firmware_files() knows.
inline constexpr const char* kFirmwares[] = {"crazyflie"};

/// [path below the app's folder] text of an out-of-tree app for `firmware`, its log's configuration and mapping, and a
/// README; the headers are not among them. io::InputError where the vehicle has other inputs than the firmware, or the
/// task's actions move one further than it can.
std::map<std::string, std::string> firmware_files(const std::string& firmware, const rollout::FlyConfig& config);

}  // namespace flappy::deploy
