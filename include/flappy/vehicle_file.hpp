// Vehicle files: TOML with `schema = 1`, one number for every entry of parameters(), `[effects.<id>]` tables, and, where
// something is known of how far these figures can be trusted,
//
//   [posterior]
//   names = ["torso.mass_kg", "effects.ground_effect.gain"]
//   means = [0.0121, 0.18]
//   covariance = [[1.6e-7, 0.0], [0.0, 0.0025]]              # in the units of the parameters
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::model {

/// Reads a vehicle. `overrides`: "left.motor.resistance_ohm=14". Throws std::runtime_error, what() "file:line:column: ..."
Vehicle read_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// As above, or one that is known by the beat (`model = "beat_averaged"` or `"predicted"`), which read_vehicle() refuses.
Vehicle read_any_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// As read_any_vehicle(), but for one whose forces are predicted for recorded flights alone: refused, for nothing flies it.
Vehicle read_flyable_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// As read_vehicle(), for physics steps of `step_s` that have to divide the driver's hold: refused where they do not.
Vehicle read_vehicle_for_steps(const std::filesystem::path& path, double step_s);

/// The same vehicle as the text of a vehicle file.
std::string vehicle_text(const Vehicle& vehicle);

}  // namespace flappy::model
