// What is left once parameters and the concluded effects are fitted, as a smooth load on the torso
// (model/effects/residual.hpp) of the corrected vehicle. The flights to be diagnosed determine it; references do not
// have it.
#pragma once

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

inline constexpr const char* kResidual = "residual";

/// Fits the load to what the corrected vehicle leaves; what the load cannot describe counts as model discrepancy. Each
/// flight is predicted with the load fitted to the other flights. None: the simulation diverges.
std::optional<ResidualLoad> fit_residual_load(const RobotFit& robot, const Fitter& fitter, const Flights& flights,
                                              int threads, const Inference& d);

/// Vehicle with the load and its limits.
model::Vehicle with_limits(model::Vehicle vehicle, const ResidualLoad& load);

}  // namespace flappy::gap
