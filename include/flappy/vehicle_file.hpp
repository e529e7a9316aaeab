// Vehicle files: TOML with `schema = 1`, one number for every element of parameters(), `[effects.<id>]` tables, points of contact as
//
//   [contact.left_foot]
//   on = "torso"                                             # or left.leading_edge, left.wing, right.leading_edge, right.wing
//   position_m = { x = 0.0, y = 0.02, z = -0.03 }            # in the frame of its body
//   stiffness_N_m = 150.0
//   damping_s_m = 0.5
//   friction = 0.6
//   grasp_m_s = 0.3                                          # optional: the point holds on to a pole that it meets more slowly
//
// and, where the uncertainty of the parameters is known,
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

/// Reads a vehicle with wings and motors; refuses beat-averaged robots and articulated wings.
/// `overrides`: "left.motor.resistance_ohm=14". Throws std::runtime_error, what() "file:line:column: ..."
Vehicle read_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Reads a vehicle of any kind, including beat-averaged robots (`model = "beat_averaged"` or `"predicted"`) and
/// articulated wings (`model = "jointed"`).
Vehicle read_any_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// As read_any_vehicle(), but refuses `model = "predicted"`: its forces exist for recorded flights only.
Vehicle read_flyable_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// As read_vehicle(); refuses a vehicle if `step_s` does not divide the driver's hold.
Vehicle read_vehicle_for_steps(const std::filesystem::path& path, double step_s);

/// Text of a vehicle file that reads back as the same vehicle.
std::string vehicle_text(const Vehicle& vehicle);

/// Reads such a text. `name`: of the file, for what is refused.
Vehicle parse_vehicle(const std::string& text, const std::string& name);

}  // namespace flappy::model
