// What changed in flights of a robot with wings since the references, whatever the cause: means of forces and moments,
// drag and thrust per input, and what sensors show, as coefficients of the regime basis in the test flights, measured by
// what sessions of the robot differ by.
#pragma once

#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// In a contrast. Differences from what the vehicle of the references would have shown, which is 0.
std::vector<SeenQuantity> changes_seen(const RobotFit& robot);

}  // namespace flappy::gap
