// Fits a smooth load on the torso (model/effects/residual.hpp) to the residual that the corrected vehicle leaves in the
// test flights.
#pragma once

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// Fits the load to what the corrected vehicle leaves; what the load cannot describe counts as model discrepancy. Each
/// flight is predicted with the load fitted to the other flights. None: the simulation diverges.
std::optional<ResidualLoad> fit_residual_load(const RobotFit& robot, const Fitter& fitter, const Flights& flights,
                                              int threads, const Inference& d);

/// Sets the limits beyond which the vehicle's load fades.
model::Vehicle with_limits(model::Vehicle vehicle, const ResidualLoad& load);

}  // namespace flappy::gap
