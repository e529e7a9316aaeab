// What models get wrong, learnt from robots that somebody trusts: flights of which all is known that the vehicle's file says.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gap/evidence/robot_fit.hpp"

namespace flappy::gap {

/// The variances of delta's coefficients by channel, harmonic and kind of function, and of every entry's sizes, that make the
/// residuals of all robots most probable: expectation-maximisation, from `start` on, whose other figures stay. Each robot is fitted;
/// what is found is taken towards that of like channels and entries, for single ones hold few coefficients.
ModelDiscrepancy learn_discrepancy(const std::vector<std::unique_ptr<RobotFit>>& robots, const ModelDiscrepancy& start);

}  // namespace flappy::gap
