// Parameters of one robot: values of the declared vehicle file, or drawn independently about them.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>

namespace flappy::blind::b {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A rigid link. com_m is in the link's frame; the inertia is about the centre of mass, in the same frame.
struct Link {
  double mass_kg = 0;
  Vector3d com_m = Vector3d::Zero();
  Matrix3d inertia_kg_m2 = Matrix3d::Zero();
};

struct Hinge {
  double lower_rad = 0, upper_rad = 0, damping_Nm_s = 0, friction_Nm = 0;
};

/// Friction, damping and inertia refer to the motor side of the gear.
struct Motor {
  double resistance_ohm = 0, torque_constant_Nm_A = 0, gear_ratio = 0, efficiency = 0;
  double friction_Nm = 0, damping_Nm_s = 0, rotor_inertia_kg_m2 = 0, voltage_limit_V = 0;
};

struct Side {
  Link edge, wing;
  Vector3d shoulder_m = Vector3d::Zero();
  Hinge stroke, rotation;
  Motor motor;
  double stiffness_positive_Nm_rad = 0, stiffness_negative_Nm_rad = 0, rest_angle_rad = 0;
  double wing_length_m = 0, mean_chord_m = 0;
  double lift = 1, drag = 1, turning_drag = 1;  ///< factors on the aerodynamic coefficients
};

struct RobotParameters {
  std::string file, sha256;  ///< declared in the log
  double density_kg_m3 = 0, flapping_Hz = 0, hold_s = 0;
  double amplitude_limit_V = 0, difference_limit_V = 0, bias_limit_V = 0, split_cycle_limit = 0;
  double full_supply = 1;  ///< voltage of the full battery over the nominal one
  double below_m = 0, above_m = 0, around_m = 0;
  Link torso;
  std::array<Side, 2> side;  ///< left, right

  double mass_kg() const;
};

inline constexpr double kGravity_m_s2 = 9.81, kPi = std::numbers::pi, kDegree = kPi / 180;

/// Reads a vehicle file. Throws InputError if a parameter is missing or out of range.
RobotParameters read_parameters(const std::filesystem::path& file);

/// What the file of the shipped vehicle states, for laws that are asked for without a file; without its name and hash.
RobotParameters nominal_parameters();

/// Draws each body and side independently: sd of masses 3 %, inertias 7 %, centres and hinges 0.3 mm, springs 5 %, rest
/// angles 1 deg, stops 2 deg, resistance 7 %, torque constant 3 %, friction 30 %, air coefficients 5 %; redrawn beyond
/// 3 sd.
void draw_parameters(std::uint64_t seed, RobotParameters& parameters);

/// Whether it is positive and no principal moment exceeds the sum of the others, to 1 in 1e3.
bool is_inertia(const Matrix3d& inertia);

}  // namespace flappy::blind::b
