// The model of a family-C robot in MuJoCo's file format.
#pragma once

#include <string>

#include "lab/blind/c/mechanism.hpp"

namespace flappy::blind::c {

/// The robot as the text of an MJCF file, the XML format of MuJoCo: bodies, hinges, stops, gravity, and the air's
/// forces on wings and torso by MuJoCo's fluid model. Callers of Mechanism add the rest: torques of motors and springs,
/// wind, contact, and the forces of air.hpp. `parameters`: of this robot, after the effects that change them; `build`:
/// the other changes of its bodies; `step_s`: time step in s.
std::string mjcf_text(const RobotParameters& parameters, const Build& build, double step_s);

}  // namespace flappy::blind::c
