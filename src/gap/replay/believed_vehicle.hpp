// The vehicle as it was believed to be, about which a diagnosis or a plan asks.
#pragma once

#include <string>

#include "flappy/vehicle.hpp"

namespace flappy::gap {

/// Reads a vehicle without effects. io::InputError for one with effects, or that cannot be flown.
model::Vehicle read_believed_vehicle(const std::string& file);
/// io::InputError if the vehicle's catalogue lacks the effect that an option names.
void check_effect(const std::string& option, const std::string& id, const model::Vehicle& vehicle);

}  // namespace flappy::gap
