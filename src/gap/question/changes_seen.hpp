// Finds what changed in flights of a robot with wings since the references, whatever the cause: means of forces and
// moments, drag, thrust per input, and what sensors show. These are coefficients of the regime basis in the test
// flights. Each is compared with what sessions of the robot differ by.
#pragma once

#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// SeenQuantity::reference is 0. SeenQuantity::tests is by how much the test flights differ from what the vehicle of
/// the references would have shown in them: in a mean, or in the slope per standard deviation of amplitude or velocity
/// over all flights. Quantities whose stream is not logged are left out. `robot`: the fit of a contrast.
std::vector<SeenQuantity> changes_seen(const RobotFit& robot);

}  // namespace flappy::gap
