// How many digits the numbers of a log have.
#pragma once

#include <vector>

namespace flappy::flightlog {

/// Median over the values of the unit of their last decimal digit, as in 0.0123: 1e-4. 0 where the values have all the
/// digits of a double, and for no values.
double last_digit(const std::vector<double>& values);

}  // namespace flappy::flightlog
