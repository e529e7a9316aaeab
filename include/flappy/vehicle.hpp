// A vehicle as its designer states it: the parameters of a vehicle file, in double, SI units, nothing derived.
// Every parameter has one path ("left.motor.resistance_ohm"), which the vehicle file, `--set`, the randomisation table and
// identification share; `parameters()` is the only list of them.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flappy::model {

struct Triple {
  double x = 0, y = 0, z = 0;
};

/// Inertia tensor elements as in a URDF: off-diagonal elements are those of the matrix (I_xy = -integral of xy).
struct InertiaTensor {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, xz = 0;
};

struct RigidBody {
  double mass_kg = 0;
  Triple com_m;                 ///< in the frame of the link
  InertiaTensor inertia_kg_m2;  ///< about the centre of mass, axes of the link
};

struct Joint {
  double lower_rad = 0, upper_rad = 0;  ///< hard stops, restitution 0
  double damping_Nm_s = 0;              ///< viscous, per rad/s
  double friction_Nm = 0;               ///< dry
};

struct Spring {
  double stiffness_positive_Nm_rad = 0;  ///< for stroke above the rest angle
  double stiffness_negative_Nm_rad = 0;  ///< for stroke below it
  double rest_angle_rad = 0;
};

/// Brushed motor behind a gear; friction, damping and inertia refer to the motor's side of the gear.
struct Motor {
  double resistance_ohm = 0;
  double torque_constant_Nm_A = 0;  ///< also the back-EMF constant, V s/rad
  double gear_ratio = 0;
  double efficiency = 0;
  double friction_Nm = 0;
  double damping_Nm_s = 0;
  double rotor_inertia_kg_m2 = 0;
  double rotor_spin_sense = 0;  ///< +1: the rotor turns as its wing strokes, -1: against it; 0 neglects its spin
  double voltage_limit_V = 0;
};

/// Blade-element planform. The dimensionless moments include their powers (r22 is r2-hat squared, z_cp* include the
/// chord squared, z_rd the chord to the fourth).
struct Planform {
  double wing_length_m = 0;
  double mean_chord_m = 0;
  double r33 = 0, r22 = 0, r11 = 0, r00 = 0;
  double z_cp2 = 0, z_cp1 = 0, z_cp0 = 0, z_rd = 0;
  double rotational_damping_coefficient = 0;
};

struct Side {
  RigidBody leading_edge;  ///< frame: shoulder, turned with the stroke
  RigidBody wing;          ///< frame: shoulder, turned with stroke and rotation
  Triple shoulder_m;       ///< in B; both hinge axes pass through it
  Joint stroke;            ///< axis +z on the left, -z on the right
  Joint rotation;          ///< axis +y of the leading edge on both sides
  Motor motor;
  Spring spring;
  Planform planform;
};

/// Limits of the wing-beat inputs, and timing of the driver.
struct Driver {
  double flapping_Hz = 0;
  double hold_s = 0;  ///< interval between updates; the voltage is constant within it
  double amplitude_limit_V = 0, difference_limit_V = 0, bias_limit_V = 0, split_cycle_limit = 0;
};

/// Extent of the vehicle from its origin, for support and contact with surfaces.
struct Extent {
  double below_m = 0;   ///< height of the origin above the ground when the vehicle stands
  double above_m = 0;   ///< to the highest point
  double around_m = 0;  ///< to the farthest point sideways
};

/// A point of a vehicle on which surfaces of the world press (src/model/contact.hpp).
struct ContactPoint {
  enum class Body { torso, left_leading_edge, left_wing, right_leading_edge, right_wing };
  std::string name;
  Body on = Body::torso;
  Triple position_m;         ///< in the frame of its body
  double stiffness_N_m = 0;  ///< normal to the surface
  double damping_s_m = 0;    ///< c: a slow impact at speed u has the coefficient of restitution 1 - c u
  double friction = 0;
  /// A point that meets a pole (a cylinder) more slowly than this holds on to it until a reset; 0: never.
  double grasp_m_s = 0;
};

/// Uncertainty of a vehicle after measurements: a joint normal distribution of parameters, which are correlated where
/// one cause moves several of them.
struct Posterior {
  std::vector<std::string> names;               ///< paths of parameters, including those of effects
  std::vector<double> means;                    ///< [name], in the unit of each parameter
  std::vector<std::vector<double>> covariance;  ///< [name][name], positive semidefinite; in their units
  bool operator==(const Posterior&) const = default;
};

/// A robot whose wings are not modelled: force and moment are means over beats, computed from its inputs and its motion
/// (src/model/beat_averaged.hpp). Its torso is the whole robot; sides and driver are unused.
struct BeatAveraged {
  bool predicted = false;        ///< force and moment stand in a file of each flight, and there are no wrenches
  double nominal_Hz = 0;         ///< approximate beat frequency
  double bandwidth_Hz = 0;       ///< up to which forces and motion are compared, well below the beat frequency
  bool compares_moments = true;  ///< whether a diagnosis compares moments with flights; it always compares forces
  /// Moments are compared as means over seconds: an autopilot counteracts what disturbs the robot, so that from moment
  /// to moment inputs follow disturbances, and on the mean they say which actuator works harder.
  bool trims = false;
  struct Input {  ///< a column of command.csv
    std::string name;
    double low = 0, high = 0;
    double neutral = 0;              ///< value while no controller is connected
    std::array<double, 4> mix = {};  ///< change per unit of the controller's four outputs, as in sim::Input
  };
  enum class Role { flapping, stroke_plane, other };
  struct Actuator {  ///< gain x input + offset, behind a first-order lag
    std::string name, input;
    Role role = Role::other;
    double gain = 1, offset = 0, lag_s = 0;
    double load_share = 1;  ///< factor on its loads; no part of a file (model/effects/actuator_loss.hpp)
  };
  struct Wrench {  ///< in B, at a point: force_x_N to moment_z_Nm as expressions, "" for zero
    std::string name;
    Triple at_m;
    std::array<std::string, 6> terms;
  };
  std::vector<Input> inputs;
  std::vector<Actuator> actuators;
  struct Coefficient {  ///< a named constant of the expressions, with its standard deviation; 0: exactly known
    std::string name;
    double value = 0, sd = 0;
    double predicted_at = 0;  ///< value with which an external simulator predicted the forces
  };
  std::vector<Coefficient> coefficients;
  std::vector<Wrench> wrenches;
};

/// A vehicle with articulated wings: every angle is fixed, driven along a gait, or free (src/model/jointed.hpp). It has
/// no motors: its driver, and stroke, rotation, motor and spring of its sides, are unused; so is a planform if there
/// are strips.
struct Jointed {
  enum class Mode { fixed, driven, free };
  struct Angle {
    Mode mode = Mode::fixed;
    double mean_rad = 0;  ///< mean of the gait; the angle itself if it is fixed
    std::vector<double> cos_rad, sin_rad;
    double stiffness_Nm_rad = 0, rest_rad = 0, damping_Nm_s = 0;
    double lower_rad = 0, upper_rad = 0;  ///< compliant stops of a free angle
    double stop_stiffness_Nm_rad = 0, stop_damping_Nm_s = 0;
  };
  struct Strip {
    double span_m = 0;   ///< distance of the middle of the strip from the shoulder
    double width_m = 0;  ///< along the span
    double chord_m = 0;
    double leading_edge_m = 0;  ///< distance of the leading edge above the axis of rotation
  };
  struct Wing {
    std::array<Angle, 4> angles;  ///< stroke plane, stroke, deviation, rotation
    std::vector<Strip> strips;
    double rotational_lift = 0, added_mass = 0;      ///< factors on theory, for strips only
    double rotational_damping_coefficient = 0;       ///< for strips only
    std::vector<double> normal_sin, tangential_cos;  ///< C_N, C_T; empty: the published C_N, no C_T
  };
  /// Change per unit of an input. An `_opposed` coefficient is added on the left and subtracted on the right.
  struct Input : BeatAveraged::Input {
    double lag_s = 0;
    double frequency = 0;  ///< change of the factor on the base frequency
    double timing = 0, timing_opposed = 0;
    std::array<double, 4> scale = {}, scale_opposed = {};  ///< change of the factor on the harmonics of each angle
    std::array<double, 4> offset_rad = {}, offset_opposed_rad = {};
  };
  double frequency_Hz = 0;
  double muscle_mass_kg = 0;  ///< 0: unknown
  std::vector<Input> inputs;
  Wing left, right;
};

struct Vehicle {
  std::string name;
  RigidBody torso;
  Side left, right;
  Driver driver;
  Extent extent;
  double air_density_kg_m3 = 0;
  std::vector<ContactPoint> contact;  ///< empty: surfaces cause events, not forces
  /// Effects beyond the base model: identifier -> parameter -> value (src/model/effects).
  std::map<std::string, std::map<std::string, double>> effects;
  std::optional<Posterior> posterior;         ///< from the vehicle file; absent in a vehicle that was drawn at random
  std::optional<BeatAveraged> beat_averaged;  ///< set: replaces wings and motors
  std::optional<Jointed> jointed;             ///< set: replaces motors
};

/// One parameter of a vehicle: its path, its place in memory, and its accepted closed interval.
struct Parameter {
  std::string path;
  double* value;
  double low, high;
  bool optional = false;  ///< 0 if a vehicle file leaves it out
};

/// All parameters of `vehicle`, in the order of the vehicle file, those of its effects last. The pointers are valid as
/// long as the vehicle.
std::vector<Parameter> parameters(Vehicle& vehicle);

/// A combination of parameters that no real vehicle has, although each parameter is in its range.
struct PhysicalFault {
  std::string path, what, accepted;
};

/// The first body whose inertia is not positive definite or violates the triangle inequality, if any.
std::optional<PhysicalFault> physical_fault(const Vehicle& vehicle);

/// What no robot that flaps can be, and a slip in a file makes: a side that is not the mirror image of the other, an
/// inertia that needs mass outside the vehicle. Files are held to it, draws are not.
std::optional<PhysicalFault> layout_fault(const Vehicle& vehicle);

}  // namespace flappy::model
