#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

namespace flappy::blind::c {

struct RigidBody {
  double mass_kg = 0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  ///< about the centre of mass
};

struct Hinge {
  double lower_rad = 0, upper_rad = 0, damping_Nm_s = 0, friction_Nm = 0;
};

/// Friction, damping and inertia are those before the gear.
struct Motor {
  double resistance_ohm = 0, torque_constant_Nm_A = 0, gear_ratio = 0, efficiency = 0, friction_Nm = 0,
         damping_Nm_s = 0, rotor_inertia_kg_m2 = 0, voltage_limit_V = 0;
};

struct Spring {
  double positive_Nm_rad = 0, negative_Nm_rad = 0, rest_rad = 0;
};

/// Length, mean chord, and the moments of area that the ellipsoids reproduce.
struct Planform {
  double length_m = 0, chord_m = 0, r33 = 0, r22 = 0, r11 = 0, r00 = 0;
};

/// Blunt, slender and angular drag, Kutta and Magnus lift, in MuJoCo's ellipsoid model.
using FluidCoefficients = std::array<double, 5>;

struct Side {
  RigidBody leading_edge, wing;
  Eigen::Vector3d shoulder_m = Eigen::Vector3d::Zero();
  Hinge stroke, rotation;
  Motor motor;
  Spring spring;
  Planform planform;
  FluidCoefficients fluid{};
};

struct RobotParameters {
  std::string file_name;
  double density_kg_m3 = 0, flapping_Hz = 0, hold_s = 0, amplitude_limit_V = 0, difference_limit_V = 0,
         bias_limit_V = 0, split_cycle_limit = 0, below_m = 0, above_m = 0, around_m = 0;
  double air = 1, supply = 1;  ///< density of the air and voltage of the full battery over those declared
  RigidBody torso;
  std::array<Side, 2> sides;  ///< left, right

  double mass_kg() const;
};

/// Throws InputError if the file is not a valid vehicle file.
RobotParameters read_parameters(const std::filesystem::path& vehicle_file);

/// Draws bodies, hinges, springs, motors and fluid coefficients independently about `nominal`.
RobotParameters drawn_parameters(const RobotParameters& nominal, std::uint64_t seed);

/// Whether the moments are positive and the largest is below the sum of the others.
bool is_physical(const Eigen::Matrix3d& inertia);
/// Returns a physical inertia unchanged; otherwise reduces the largest principal moment to the physical limit.
Eigen::Matrix3d made_physical(const Eigen::Matrix3d& inertia);

inline constexpr double kDegree = M_PI / 180;

}  // namespace flappy::blind::c
