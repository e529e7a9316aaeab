// Whether a step resolves the beat of a vehicle's wings.
//
// A step of h samples a harmonic n of the beat f at 1/(n f h) points a cycle. The method is of second order, so the
// error of what the harmonic does is in proportion to (n f h)^2. Over harmonics that turn a wing with the rates v_n, n
// times the amplitude, the mean of n^2 is k^2 = sum n^2 v_n^2 / sum v_n^2, over all driven angles; k is at least 2, as
// wings that hang on a hinge or land on a stop flip faster than they stroke. Steps per cycle: 1/(k f h), f the fastest
// beat that inputs ask for. docs/results/accuracy.md has the errors.
#pragma once

#include <optional>
#include <string>

#include "flappy/vehicle.hpp"

namespace flappy::model {

/// Fewer steps per cycle are refused; with kEnoughSteps the lift is right within a per cent, fewer are warned of.
inline constexpr double kFewestSteps = 4, kEnoughSteps = 8;

struct CoarseStep {
  std::string what;  ///< what is wrong with the step
  double enough_s;   ///< longest step that does
  bool refused;
};

/// Empty for a step that does, and for a beat-averaged vehicle, which has no beat to resolve.
std::optional<CoarseStep> coarse_step(const Vehicle& vehicle, double step_s);

}  // namespace flappy::model
