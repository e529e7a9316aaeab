// From a vehicle's published figures to the constants of the step.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/effects/effect.hpp"

namespace flappy::model {

/// Constants of one flapper in double precision. `step_s`: physics step, s.
Parameters<double> derive(const Vehicle& vehicle, double step_s);

/// Single-point blade element of a planform: what SideParameters has of it, all else 0.
SideParameters<double> derive_planform(const Planform& planform, double air_density_kg_m3);

/// A body's first and second moment of mass about its frame's origin, kg m and kg m^2.
Vec3<double> first_moment(const RigidBody& body);
Sym3<double> second_moment(const RigidBody& body);

/// The vehicle with those of its effects that are part of it.
Vehicle built(Vehicle vehicle);

/// What effects need to know besides.
Sides<SideFigures<double>> effect_figures(const Vehicle& vehicle);

/// Beats a second at which it flies, about.
double beats_Hz(const Vehicle& vehicle);

/// Mass of the whole vehicle, kg.
double total_mass_kg(const Vehicle& vehicle);

}  // namespace flappy::model
