// The escape: a robot that hovers behind the goal, a policy that acts, and the pilot who takes over.
#pragma once

#include "blind/family.hpp"

namespace flappy::blind::b {

FamilyEscape fly_escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules);

}  // namespace flappy::blind::b
