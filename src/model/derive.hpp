// From a vehicle's published figures to the constants of the step.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/effects/effect.hpp"

namespace flappy::model {

/// Constants of one flapper in double precision. `step_s`: physics step, s.
Parameters<double> derive(const Vehicle& vehicle, double step_s);

/// The vehicle with those of its effects that are part of it.
Vehicle built(Vehicle vehicle);

/// What effects need to know besides.
Sides<SideFigures<double>> effect_figures(const Vehicle& vehicle);

/// Beats a second at which it flies, about.
double beats_Hz(const Vehicle& vehicle);

/// Mass of the whole vehicle, kg.
double total_mass_kg(const Vehicle& vehicle);

}  // namespace flappy::model
