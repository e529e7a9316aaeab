// Family A: the blind robot of this folder behind the interface that all families have.
#pragma once

#include <memory>

#include "blind/a/flights.hpp"
#include "blind/family.hpp"

namespace flappy::blind {

std::unique_ptr<Family> make_family_a();

/// The robot of an assignment as this folder flies it; the log of a robot with `conventions` declares some of it otherwise.
Case case_of(const Assignment& a);

}  // namespace flappy::blind
