// Reads the vehicle as it was believed to be, about which a diagnosis or a plan asks.
#pragma once

#include <string>

#include "flappy/vehicle.hpp"

namespace flappy::gap {

/// A beat-averaged vehicle, which may have effects, or one with wings and motors without effects. io::InputError for a
/// file that is no vehicle, or one whose wing angles are driven. Of vehicles with wings also if it has effects, if the
/// driver's hold time is no multiple of kHoldStep_s, or if this step is too coarse for it.
model::Vehicle read_believed_vehicle(const std::string& file);
/// io::InputError if the vehicle's catalogue lacks the effect `id`. `option`: the option that names it, for the
/// message.
void check_effect(const std::string& option, const std::string& id, const model::Vehicle& vehicle);

}  // namespace flappy::gap
