// The escape of a robot of family C, flown by a policy that was trained in another simulator.
#pragma once

#include "lab/blind/c/c_flight.hpp"

namespace flappy::blind::c {

FamilyEscape escape_of(const Assignment& a, std::size_t number, const EscapeAssignment& rules,
                       double trim_s = Length{}.trim_s);

}  // namespace flappy::blind::c
