// Checks whether a measured map uses the axes of the vehicle. A channel that responds to an input with the opposite sign, beyond noise
// and beyond the error of any model, is a mistake of the table and not a property of a robot.
//
//   - Slopes: thrust, roll, pitch and yaw respond to amplitude, difference, bias and split cycle. Force x responds to bias and force y
//     to difference, less reliably: an opposite slope counts only if it is half as steep as the vehicle's and twice as significant.
//     Slopes are fitted over all rows; where rows are too few, pairs of rows that differ in one input alone are compared.
//   - Single rows: thrust must not be opposite to the vehicle's; a torque must not be opposite to the vehicle's plus the offset of the
//     whole map while it is an outlier among the rows. Force x and y of single rows are not checked, because an asymmetry of the wings
//     changes them more than any input does.
#pragma once

#include <string>
#include <vector>

#include "identify/measured_map.hpp"

namespace flappy::identify {

/// Slope of a channel against an input while the other inputs are constant.
struct Slope {
  double value = 0, sd = 0;
};
/// Least squares of each channel on the four inputs and a constant: [input][channel]. Inputs that do not vary have slope
/// 0, sd 0.
std::array<std::array<Slope, kChannels>, 4> slopes(const std::vector<sim::Input>& inputs,
                                                   const std::vector<Wrench>& wrenches);

/// InputError "file:line: column: ..." for a sign that the simulated map contradicts and for swapped torque columns.
/// Returns the columns whose sign these inputs do not determine.
std::vector<std::string> check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated);

}  // namespace flappy::identify
