#pragma once

#include <string>

#include "blind/c/mechanism.hpp"

namespace flappy::blind::c {

std::string mjcf_text(const RobotParameters& parameters, const Build& build, double step_s);

}  // namespace flappy::blind::c
