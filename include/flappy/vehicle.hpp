// A vehicle as its designer states it: the figures of a vehicle file, in double, SI units, nothing derived.
// Every leaf number has one path ("left.motor.resistance_ohm") that the vehicle file, `--set`, the
// randomisation table and identification share; `parameters()` is the one list of them.
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

/// Inertia tensor elements as in a URDF: off-diagonal elements are those of the matrix (I_xy = -integral of
/// xy).
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

/// Brushed motor behind a gear; friction, damping and inertia are on the motor's side of the gear.
struct Motor {
  double resistance_ohm = 0;
  double torque_constant_Nm_A = 0;  ///< also the back-EMF constant, V s/rad
  double gear_ratio = 0;
  double efficiency = 0;
  double friction_Nm = 0;
  double damping_Nm_s = 0;
  double rotor_inertia_kg_m2 = 0;
  double rotor_spin_sense = 0;  ///< +1: the rotor turns as its wing strokes, -1: against it; 0 leaves its spin out
  double voltage_limit_V = 0;
};

/// Blade-element planform. The dimensionless moments have their powers already taken
/// (r22 is r2-hat squared, z_cp* carry chord squared, z_rd chord to the fourth).
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

/// What the wing-beat driver accepts and how it drives.
struct Driver {
  double flapping_Hz = 0;
  double hold_s = 0;  ///< the voltage is held between updates
  double amplitude_limit_V = 0, difference_limit_V = 0, bias_limit_V = 0, split_cycle_limit = 0;
};

/// Extent of the vehicle from its origin, for support and contact.
struct Extent {
  double below_m = 0;   ///< origin above the ground when the vehicle stands
  double above_m = 0;   ///< to the highest point
  double around_m = 0;  ///< to the farthest point sideways
};

/// A point of a vehicle that the world presses on where they meet (src/model/contact.hpp).
struct ContactPoint {
  enum class Body { torso, left_leading_edge, left_wing, right_leading_edge, right_wing };
  std::string name;
  Body on = Body::torso;
  Triple position_m;         ///< in the frame of its body
  double stiffness_N_m = 0;  ///< of the point, normal to the surface
  double damping_s_m = 0;    ///< what restitution loses per speed of a slow impact
  double friction = 0;
  double grasp_m_s = 0;  ///< it holds on to a pole (a cylinder) that it meets more slowly, until a reset; 0: never
};

/// What measurements left uncertain of a vehicle: a normal distribution of parameters. Several may move together, one
/// cause behind them.
struct Posterior {
  std::vector<std::string> names;               ///< paths of parameters, those of effects among them
  std::vector<double> means;                    ///< one for each, in its unit
  std::vector<std::vector<double>> covariance;  ///< symmetric, positive semidefinite; in their units
  bool operator==(const Posterior&) const = default;
};

/// A robot whose wings are not modelled: what acts on it as means over beats, from its inputs and its motion
/// (src/model/beat_averaged.hpp). Its torso is all of it; sides and driver say nothing.
struct BeatAveraged {
  bool predicted = false;        ///< force and moment stand in a file of each flight; then there are no wrenches
  double nominal_Hz = 0;         ///< beats, about
  double bandwidth_Hz = 0;       ///< up to which force and motion are compared, well below the beat
  bool compares_moments = true;  ///< with flights; forces always
  struct Input {                 ///< a column of command.csv
    std::string name;
    double low = 0, high = 0;
    double neutral = 0;              ///< of a controller that says nothing
    std::array<double, 4> mix = {};  ///< of its amplitude, difference, bias and split cycle: what each adds
  };
  enum class Role { flapping, stroke_plane, other };
  struct Actuator {  ///< gain x input + offset, behind a first-order lag
    std::string name, input;
    Role role = Role::other;
    double gain = 1, offset = 0, lag_s = 0;
  };
  struct Wrench {  ///< in B, at a point: force_x_N to moment_z_Nm as expressions, "" where there is none
    std::string name;
    Triple at_m;
    std::array<std::string, 6> terms;
  };
  std::vector<Input> inputs;
  std::vector<Actuator> actuators;
  struct Coefficient {  ///< a named number of the expressions, and how well it is known, 0: exactly
    std::string name;
    double value = 0, sd = 0;
    double predicted_at = 0;  ///< what a simulator took for it
  };
  std::vector<Coefficient> coefficients;
  std::vector<Wrench> wrenches;
};

/// A vehicle whose sides have four angles each: fixed, driven along a gait, or free (src/model/jointed.hpp). It has no motors: its driver, and
/// stroke, rotation, motor and spring of its sides, say nothing; nor does a planform where there are strips.
struct Jointed {
  enum class Mode { fixed, driven, free };
  struct Angle {
    Mode mode = Mode::fixed;
    double mean_rad = 0;  ///< of a gait; all of it where it is fixed
    std::vector<double> cos_rad, sin_rad;
    double stiffness_Nm_rad = 0, rest_rad = 0, damping_Nm_s = 0;
    double lower_rad = 0, upper_rad = 0;  ///< compliant stops of a free angle
    double stop_stiffness_Nm_rad = 0, stop_damping_Nm_s = 0;
  };
  struct Strip {
    double span_m = 0;   ///< of its middle, from the shoulder
    double width_m = 0;  ///< along the span
    double chord_m = 0;
    double leading_edge_m = 0;  ///< above the axis of rotation
  };
  struct Wing {
    std::array<Angle, 4> angles;  ///< stroke plane, stroke, deviation, rotation
    std::vector<Strip> strips;
    double rotational_lift = 0, added_mass = 0;      ///< factors on theory; strips alone have them
    double rotational_damping_coefficient = 0;       ///< of strips
    std::vector<double> normal_sin, tangential_cos;  ///< C_N, C_T; empty: the published C_N, no C_T
  };
  /// What 1 of an input adds, of which opposed ones are added on the left and taken on the right.
  struct Input : BeatAveraged::Input {
    double lag_s = 0;
    double frequency = 0;  ///< to the factor on the base frequency
    double timing = 0, timing_opposed = 0;
    std::array<double, 4> scale = {}, scale_opposed = {};  ///< to the factor on harmonics of each angle
    std::array<double, 4> offset_rad = {}, offset_opposed_rad = {};
  };
  double frequency_Hz = 0;
  double muscle_mass_kg = 0;  ///< 0: not known
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
  std::vector<ContactPoint> contact;  ///< none: surfaces are events, not forces
  /// Effects beyond the base model: identifier -> parameter -> value (src/model/effects).
  std::map<std::string, std::map<std::string, double>> effects;
  std::optional<Posterior> posterior;         ///< of the file it was read from; a vehicle drawn at random has none
  std::optional<BeatAveraged> beat_averaged;  ///< instead of wings and motors
  std::optional<Jointed> jointed;             ///< instead of motors
};

/// One leaf of a vehicle: where it is, and what is accepted there (closed interval).
struct Parameter {
  std::string path;
  double* value;
  double low, high;
  bool optional = false;  ///< 0 where a vehicle file leaves it out
};

/// All parameters of `vehicle`, in the order of the vehicle file, those of its effects last. Pointers live as long as the
/// vehicle.
std::vector<Parameter> parameters(Vehicle& vehicle);

/// What no real vehicle has, though each number alone is accepted.
struct PhysicalFault {
  std::string path, what, accepted;
};

/// The first inertia that breaks the triangle inequality, if any.
std::optional<PhysicalFault> physical_fault(const Vehicle& vehicle);

}  // namespace flappy::model
