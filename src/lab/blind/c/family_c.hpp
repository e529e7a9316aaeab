// Family C: MuJoCo's engine and fluid model. Effects, sensors, conventions and pilot are this family's own.
#pragma once

#include <memory>

#include "lab/blind/family.hpp"

namespace flappy::blind::c {

std::unique_ptr<Family> make_family_c();

}  // namespace flappy::blind::c
