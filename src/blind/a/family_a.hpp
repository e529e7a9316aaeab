// Family A: the blind robot of this folder behind the common interface.
#pragma once

#include <memory>

#include "blind/a/flights.hpp"
#include "blind/family.hpp"

namespace flappy::blind {

std::unique_ptr<Family> make_family_a();

/// The case of an assignment, with exact declarations. With `conventions`, Family::fly then changes some in the log.
Case case_of(const Assignment& a);

}  // namespace flappy::blind
