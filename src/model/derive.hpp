// From a vehicle's published figures to the constants of the step.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/effects/effect.hpp"
#include "model/jointed_dynamics.hpp"
#include "model/strip_aerodynamics.hpp"

namespace flappy::model {

/// Constants of one flapper in double precision. `step_s`: physics step, s.
Parameters<double> derive(const Vehicle& vehicle, double step_s);

/// Beats of wings, about, 1/s.
double beat_Hz(const Vehicle& vehicle);

/// Constants of a vehicle with four angles a wing; `side`: +1 left, -1 right.
JointedParameters<double> derive_jointed(const Vehicle& vehicle);
std::vector<Strip<double>> derive_strips(const Jointed::Wing& wing, double air_density_kg_m3, double side);
SeriesOfForce<double> derive_series(const Jointed::Wing& wing);

/// The vehicle with those of its effects that are part of it.
Vehicle built(Vehicle vehicle);

/// What effects need to know besides.
Sides<SideFigures<double>> effect_figures(const Vehicle& vehicle);

/// Mass of the whole vehicle, kg.
double total_mass_kg(const Vehicle& vehicle);

}  // namespace flappy::model
