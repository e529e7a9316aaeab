// Builds the vehicle of a design: a published robot, changed in what a workshop can change.
//
// Everything that is not varied stays as published. A change moves mass by laws: of the wing's panel and rod
// (design/wing.hpp), of the motor from the catalogue, and of the battery, each as what the new part has minus what the
// built one has, so that the design without changes is the published robot, to the digit.
#pragma once

#include <string>
#include <vector>

#include "design/wing.hpp"
#include "io/config.hpp"

namespace flappy::design {

/// A motor that can be bought. The friction torque is that of its no-load current.
struct MotorType {
  std::string name, source;
  double mass_kg = 0;
  double resistance_ohm = 0, torque_constant_Nm_A = 0, rotor_inertia_kg_m2 = 0, friction_Nm = 0, damping_Nm_s = 0;
  double current_limit_A = 0;
  double winding_K_W = 0, housing_K_W = 0;  ///< thermal resistance from winding to housing, from housing to ambient
  double winding_s = 0, housing_s = 0;      ///< time constants of the two
  double winding_limit_C = 0;
};

/// Parts of the built robot that a vehicle file does not state, and stocks of the workshop.
struct Workshop {
  std::vector<MotorType> motors;
  std::size_t built_motor = 0;
  model::Triple motor_m;       ///< from the left shoulder to the left motor, in B; mirrored on the right
  model::Triple battery_m;     ///< in B
  Panel panel;                 ///< its areal density is that of the built wing
  std::vector<double> rods_m;  ///< diameters in stock
  double built_rod_m = 0, rod_kg_m3 = 0;
  double least_chord_m = 0;      ///< a narrower panel cannot be glued
  double wing_clearance_m = 0;   ///< least distance between the two leading edges at the ends of the strokes
  double pinion_m = 0;           ///< pitch radius of the motor's pinion; that of the wheel is so much times the ratio
  double module_m = 0;           ///< of the gear: its teeth rise so far above the pitch radius
  double wheel_clearance_m = 0;  ///< least distance of the teeth of the two wheels
  double built_wheel_kg_m2 = 0;  ///< inertia of the built wheel about the stroke's axis
  double battery_J_kg = 0;       ///< usable energy per mass
  double cell_V = 0;             ///< voltage of a cell; a battery is a whole number of cells in series
  double ambient_C = 0, flight_s = 0;  ///< a flight so long heats the windings
};

/// The quantities of a robot that a search can vary; info_of() names them.
enum class Quantity {
  wing_length,
  mean_chord,
  root_chord,
  tip_chord,
  spring,
  rest_angle,
  gear_ratio,
  frequency,
  rotation_stop,
  shoulder_x,
  shoulder_y,
  shoulder_z,
  motor,
  cells,
  battery
};
inline constexpr std::size_t kQuantities = 15;
struct QuantityInfo {
  const char *name, *words;
  double low, high;  ///< accepted in a configuration
};
const QuantityInfo& info_of(Quantity quantity);

/// A quantity that the search varies: between low and high, in steps from low; 0: continuously. Of motors: numbers in
/// `choices`, indices in Workshop::motors.
struct Variable {
  Quantity quantity;
  double low = 0, high = 0, step = 0;
  std::vector<std::size_t> choices;
};

/// Values of all quantities; the motor by its index in the catalogue.
using Values = std::array<double, kQuantities>;
inline double& value_of(Values& values, Quantity q) { return values[static_cast<std::size_t>(q)]; }
inline double value_of(const Values& values, Quantity q) { return values[static_cast<std::size_t>(q)]; }

struct Space {
  model::Vehicle published;
  Workshop workshop;
  std::vector<Variable> variables;
  Values built;  ///< values that the published robot has

  /// Values of a point of the unit cube, [variable], rounded to their steps.
  Values values(const std::vector<double>& unit) const;
  std::vector<double> unit(const Values& values) const;
};

struct Robot {
  Values values;
  model::Vehicle vehicle;
  WingShape wing;
  double rod_m = 0;
  const MotorType* motor = nullptr;
  double battery_J = 0;
  std::string refused;  ///< why it cannot be built; empty: it can
};

Robot build(const Space& space, const Values& values);

/// Inertia of the whole robot about its centre of mass in B, wings in the middle of their strokes, hanging down; and
/// that centre.
struct WholeBody {
  double mass_kg;
  model::Triple com_m;
  model::InertiaTensor inertia_kg_m2;
};
WholeBody whole_body(const model::Vehicle& vehicle);

/// Reads [built], [workshop] and [vary] of a configuration.
Space read_space(const io::Table& root);

}  // namespace flappy::design
