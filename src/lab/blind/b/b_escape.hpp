#pragma once

#include "lab/blind/family.hpp"

namespace flappy::blind::b {

/// Implements Family::escape, after trimming at the start position. Observed values are in the order of their names.
FamilyEscape fly_escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules, double trim_s = 5);

}  // namespace flappy::blind::b
