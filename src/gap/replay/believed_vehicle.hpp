// Reads the vehicle file that a diagnosis or a plan asks about: the robot as it is believed to be.
#pragma once

#include <string>

#include "flappy/vehicle.hpp"

namespace flappy::gap {

/// Returns a beat-averaged vehicle, with or without effects, or a vehicle with wings and motors, without effects.
/// io::InputError for a file that is no vehicle, or one with articulated wings. For a vehicle with wings and motors
/// also if it has effects, if the driver's hold time is no multiple of kHoldStep_s, or if a step of kHoldStep_s is too
/// coarse.
model::Vehicle read_believed_vehicle(const std::string& file);
/// io::InputError if the vehicle's catalogue lacks the effect `id`. `option`: the option that names it, for the
/// message.
void check_effect(const std::string& option, const std::string& id, const model::Vehicle& vehicle);

}  // namespace flappy::gap
