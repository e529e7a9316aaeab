// Bodies as moments of mass, which add and subtract: mass, first moment h = integral of r, second moment P = integral of
// r r^T, all about the origin of the body's frame.
#pragma once

#include "flappy/vehicle.hpp"
#include "model/derive.hpp"

namespace flappy::design {

struct Mass {
  double mass_kg = 0;
  model::Vec3<double> first_kg_m{0, 0, 0};
  model::Sym3<double> second_kg_m2{0, 0, 0, 0, 0, 0};

  Mass& add(const Mass& other, double factor = 1);
};

Mass mass_of(const model::RigidBody& body);
Mass point_mass(double mass_kg, const model::Triple& at_m);
/// The body with these moments; its mass must not be 0.
model::RigidBody body_of(const Mass& mass);

}  // namespace flappy::design
