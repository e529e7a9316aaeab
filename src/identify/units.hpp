// Checks whether a measured map is in the units of its columns: volts, newtons, newton metres, and with the weight of
// the robot tared. What is found here would otherwise be fitted by any parameter that scales a force.
//   - A slope of thrust against the amplitude 3 times as steep as the vehicle's, or a third, where all other forces
//     whose slopes are seen are off the same way. No fit's bounds hold such a vehicle (tests/identify/signs_test.cpp).
//     Without a slope, all forces together 10 times off. Torques: all three slopes 10 times off, alike.
//   - A thrust that is the vehicle's less its weight at every input.
//   - Amplitudes of at most 1 V that give several times the vehicle's forces: duty cycles.
#pragma once

#include <vector>

#include "identify/measured_map.hpp"

namespace flappy::identify {

/// InputError "file:1: column: ..." with the unit that is likely meant. `simulated`: the vehicle's map of these inputs.
void check_units(const MeasuredMap& measured, const std::vector<Wrench>& simulated, const model::Vehicle& vehicle);

}  // namespace flappy::identify
