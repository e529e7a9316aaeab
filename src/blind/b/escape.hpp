// The escape: the robot hovers at a start, a policy flies the manoeuvre, and the pilot takes over.
#pragma once

#include "blind/family.hpp"

namespace flappy::blind::b {

/// Implements Family::escape; the robot first finds its trim at the start position. Values of the observation are in the order of its
/// names.
FamilyEscape fly_escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules, double trim_s = 5);

}  // namespace flappy::blind::b
