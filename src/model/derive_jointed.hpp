// Constants of the step from the parameters of a vehicle with articulated wings.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/jointed_dynamics.hpp"
#include "model/strip_aerodynamics.hpp"

namespace flappy::model {

/// `side`: +1 left, -1 right. Strips and series belong to strip_aerodynamics.hpp.
JointedParameters<double> derive_jointed(const Vehicle& vehicle);
std::vector<Strip<double>> derive_strips(const Jointed::Wing& wing, double air_density_kg_m3, double side);
SeriesOfForce<double> derive_series(const Jointed::Wing& wing);

}  // namespace flappy::model
