// Family A: the blind robot of this folder behind the common interface.
#pragma once

#include <memory>

#include "lab/blind/a/flights.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind {

std::unique_ptr<Family> make_family_a();

/// True robot and sensors of an assignment. Assignment::conventions draws other sensors; fly() then misdeclares them.
Case case_of(const Assignment& a);

}  // namespace flappy::blind
