// Constants of the step from the published parameters of a vehicle.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/effects/effect.hpp"

namespace flappy::model {

Parameters<double> derive(const Vehicle& vehicle, double step_s);

/// The members of SideParameters that describe the planform as a single-point blade element; all others are 0.
SideParameters<double> derive_planform(const Planform& planform, double air_density_kg_m3);

Vec3<double> first_moment(const RigidBody& body);
Sym3<double> second_moment(const RigidBody& body);

/// The vehicle after its effects of Stage::body have changed it.
Vehicle built(Vehicle vehicle);

/// Constants that effects need in addition to Parameters; 0 for beat-averaged robots and articulated wings.
Sides<SideConstants<double>> effect_constants(const Vehicle& vehicle);

/// Beat frequency: of the driver, of the gait, or the nominal one.
double beats_Hz(const Vehicle& vehicle);

double total_mass_kg(const Vehicle& vehicle);

}  // namespace flappy::model
