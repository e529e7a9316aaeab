// Checks whether a measured map uses the vehicle's axes: an opposite response, beyond noise and any model's error, is a
// mistake of the table and not a property of a robot.
//   - Slopes: thrust, roll, pitch, yaw respond to amplitude, difference, bias, split cycle. Force x responds to bias,
//     y to difference, less reliably: an opposite slope counts only if half as steep as the vehicle's and twice as
//     significant. Fitted over all rows; with too few, pairs of rows that differ in one input alone are compared.
//   - Rows: thrust must not be opposite to the vehicle's, an outlying torque not to the vehicle's plus the map's
//     offset. Not force x and y: an asymmetry of the wings changes them more than any input.
#pragma once

#include <string>
#include <vector>

#include "identify/measured_map.hpp"

namespace flappy::identify {

/// Slope of a channel against an input while the other inputs are constant.
struct Slope {
  double value = 0, sd = 0;
};
/// Slopes [input][channel] by least squares on the inputs and a constant; 0, sd 0 for an input that does not vary.
std::array<std::array<Slope, kChannels>, 4> slopes(const std::vector<sim::Input>& inputs,
                                                   const std::vector<Wrench>& wrenches);

/// InputError "file:line: column: ..." for signs that the simulation contradicts and for swapped torque columns.
/// Returns the columns whose sign these inputs do not determine.
std::vector<std::string> check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated);

}  // namespace flappy::identify
