// The escape: a robot that hovers behind the goal, a policy that acts, and the pilot who takes over.
#pragma once

#include "blind/family.hpp"

namespace flappy::blind::b {

/// As Family::escape has it; the robot first finds its trim at the start. The observation's numbers come in the order of its names.
FamilyEscape fly_escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules, double trim_s = 5);

}  // namespace flappy::blind::b
