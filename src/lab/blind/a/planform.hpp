// A wing cut into strips along its span, from the published moments of its planform.
#pragma once

#include <array>

#include "flappy/vehicle.hpp"

namespace flappy::blind {

inline constexpr std::size_t kStrips = 16;

struct Strips {
  std::array<double, kStrips> r_m{};      ///< middle of the strip, from the shoulder
  std::array<double, kStrips> chord_m{};  ///< chord at r_m, a cubic in r
  double width_m = 0;
};

/// Fits a cubic chord to the eight moments of the planform by least squares. The published moments are those of a
/// trapezoid to 1e-4; 16 strips reproduce them to 2e-3.
Strips cut_into_strips(const model::Planform& planform);

}  // namespace flappy::blind
