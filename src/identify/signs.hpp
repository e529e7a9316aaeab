// Whether a measured map has its axes as the vehicle's: what answers an input with the opposite sign, beyond noise and
// beyond what a wrong model can do, is a mistake of the table and no property of a robot.
//
//   - thrust, roll, pitch and yaw answer amplitude, difference, bias and split cycle. Force x answers bias and force y
//     difference, less surely: their opposite must be half as steep as the vehicle's answer, and twice as clear. Slopes
//     are over all rows; where rows are too few for them, between any two that differ in that input alone;
//   - a single row: thrust against its own sign; a torque against the vehicle's plus the offset of the whole map, where it
//     stands out of what the other rows leave. Force x and y of single rows have no reliable sign: asymmetry of the wings
//     moves them more than any input does.
#pragma once

#include <string>
#include <vector>

#include "identify/measured_map.hpp"

namespace flappy::identify {

/// Slope of a channel against an input, the other inputs held.
struct Slope {
  double value = 0, sd = 0;
};
/// Least squares of each channel on the four inputs and a constant: [input][channel]. Inputs that do not vary have slope
/// 0, sd 0.
std::array<std::array<Slope, kChannels>, 4> slopes(const std::vector<sim::Input>& inputs,
                                                   const std::vector<Wrench>& wrenches);

/// InputError "file:line: column: ..." for a sign that the simulated map contradicts, or a torque that answers in another's
/// place. Returns the columns whose sign these inputs do not tell.
std::vector<std::string> check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated);

}  // namespace flappy::identify
