// Blind robots in MuJoCo's engine and MuJoCo's fluid model, with effects, sensors, conventions and a pilot of their own.
#pragma once

#include <memory>

#include "blind/family.hpp"

namespace flappy::blind::c {

std::unique_ptr<Family> make_family_c();

}  // namespace flappy::blind::c
