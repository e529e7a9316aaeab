// Reads the vehicle as it was believed to be, about which a diagnosis or a plan asks.
#pragma once

#include <string>

#include "flappy/vehicle.hpp"

namespace flappy::gap {

/// A beat-averaged vehicle, which may have effects, or one with wings and motors without effects. io::InputError for a
/// file that is no vehicle; of vehicles with wings also if it has effects, or cannot be stepped by kHoldStep_s.
model::Vehicle read_believed_vehicle(const std::string& file);
/// io::InputError if the vehicle's catalogue lacks the effect `id`. `option`: the option that names it, for the
/// message.
void check_effect(const std::string& option, const std::string& id, const model::Vehicle& vehicle);

}  // namespace flappy::gap
