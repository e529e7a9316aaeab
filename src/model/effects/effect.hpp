// An effect beyond the base model is one file in this folder: a struct with
//   kInfo                what it is called, where it acts, where it vanishes, its source
//   kParameters          their names, units and ranges
//   one or more stages   static templates over the scalar type that change what the stage hands on
// and one line in registry.hpp. Simulation, randomisation, the vehicle file and diagnosis read that one
// description. A stage is found by its name; an effect without it costs nothing there:
//   air(parameters, surroundings, AirFactor&)     scales what the air does to the wings
//   world(parameters, surroundings, BodyLoad&)    loads the body besides its wings
#pragma once

#include <array>

#include "model/vehicle_dynamics.hpp"

namespace flappy::model {

/// The stage of the step that an effect acts on.
enum class Stage { air, wing, drive, world, sensor };

struct EffectParameter {
  const char* name;  ///< with its unit as suffix
  double low, high;  ///< accepted in a vehicle file
  double typical;    ///< when switched on without a figure of its own
};

struct EffectInfo {
  const char* id;
  Stage stage;
  int vanishing;           ///< index of the parameter that switches the effect off,
  double vanishing_value;  ///< exactly, at this value
  const char* source;
};

inline namespace FLAPPY_ISA {

/// What effects may look at.
template <class T>
struct Surroundings {
  Matrix3<T> attitude;      // R_WB
  Vec3<T> position_m;       // torso origin, in W
  Vec3<T> velocity_B_m_s;   // of the torso origin, in B
  Vec3<T> body_rate_rad_s;  // in B
  Vec3<T> com_m;            // vehicle's centre of mass from the torso origin, in B
  T stroke_plane_m;         // height of the shoulders above the torso origin along z of B
  T air_density_kg_m3;
  T ground_z_m, ceiling_z_m;
};

/// Factor on the aerodynamic force and moment of each wing.
template <class T>
struct AirFactor {
  T left, right;
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
