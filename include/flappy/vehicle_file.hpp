// Vehicle files: TOML with `schema = 1`, one number for every entry of parameters(), and `[effects.<id>]`
// tables.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::model {

/// Reads a vehicle. `overrides`: "left.motor.resistance_ohm=14". Throws std::runtime_error, what() "file:line:column: ..."
Vehicle read_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// The same vehicle as the text of a vehicle file.
std::string vehicle_text(const Vehicle& vehicle);

}  // namespace flappy::model
