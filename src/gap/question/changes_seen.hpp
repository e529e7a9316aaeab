// What changed in flights of a robot with wings since the references, whatever the cause: means of forces and moments,
// drag and thrust per input, and what sensors show, as coefficients of the regime basis in the test flights, measured
// by what sessions of the robot differ by.
#pragma once

#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// `robot`: of a contrast. SeenQuantity::reference is 0, and tests is by how much the test flights differ from what the
/// vehicle of the references would have shown there: a mean, or the change per standard deviation that amplitude or
/// velocity have over all flights. Without quantities whose stream is not logged.
std::vector<SeenQuantity> changes_seen(const RobotFit& robot);

}  // namespace flappy::gap
