// What the two peers share: an interface, and the wing aerodynamics and motor written straight from the
// textbook equations (angle of attack by arc tangent, plain double), independent of src/model.
#pragma once

#include <array>

#include "flappy/vehicle.hpp"

namespace flappy::reference {

using Vec3 = std::array<double, 3>;
using Quat = std::array<double, 4>;     ///< w, x, y, z
using PerWing = std::array<double, 2>;  ///< left, right

/// A vehicle's state. Stroke and rotation are joint angles: positive stroke is backward on both sides.
struct PeerState {
  Vec3 p_WB_W_m{};        ///< torso origin
  Quat q_WB{1, 0, 0, 0};  ///< body to world
  Vec3 v_WB_W_m_s{};      ///< of the torso origin
  Vec3 w_WB_B_rad_s{};
  PerWing stroke_rad{}, rotation_rad{};
  PerWing stroke_rate_rad_s{}, rotation_rate_rad_s{};
};

/// The air velocity a wing sees: that of its shoulder, or the published simulator's oddity, which measures
/// the shoulder from the torso's origin but adds the velocity of the torso's centre of mass, 1.4 mm away.
enum class ShoulderVelocity { exact, published };

/// Coulomb friction of the four joints (the motor's own always acts): the bare sign of the joint's rate, or
/// the engine's constraint, which can stick and costs both engines a quarter of their speed or more.
enum class DryFriction { none, sign, constraint };

struct PeerOptions {
  double step_s = 1e-4;
  double gravity_m_s2 = 9.81;
  bool torso_welded = false;  ///< torso origin held at the origin of W, level
  ShoulderVelocity shoulder = ShoulderVelocity::exact;
  DryFriction dry_friction = DryFriction::sign;
};

/// Force in B and moment about the torso origin in B.
struct Wrench {
  Vec3 force_N{}, moment_Nm{};
};

/// The air on one wing: a force along wing-link +x at (0, +-span_m, -depth_m), a moment about wing-link +y.
struct WingLoad {
  double angle_of_attack_rad = 0;
  double normal_force_N = 0;
  double span_m = 0, depth_m = 0;
  double damping_moment_Nm = 0;
};

/// All that acts at one instant beyond gravity, inertia and stops. Torques are at the joints.
struct Loads {
  std::array<WingLoad, 2> wing;
  PerWing spring_Nm{};    ///< stroke
  PerWing stroke_Nm{};    ///< motor without its rotor's inertia, joint damping, friction if by sign
  PerWing rotation_Nm{};  ///< joint damping, friction if by sign
};

/// +1 for the left wing (index 0), -1 for the right one.
constexpr double side_sign(std::size_t wing) { return wing == 0 ? 1.0 : -1.0; }

constexpr const model::Side& side_of(const model::Vehicle& vehicle, std::size_t wing) {
  return wing == 0 ? vehicle.left : vehicle.right;
}

/// Rotor inertia as the stroke joint feels it, kg m^2.
double reflected_rotor_inertia(const model::Motor& motor);

/// Linear damping of the stroke, N m s: its hinge, the motor's own, and its back EMF.
double stroke_damping(const model::Side& side);

/// Stiffness in force at that stroke, N m/rad.
double spring_stiffness(const model::Spring& spring, double stroke_rad);

/// Loads in `state` with these voltages at the motors (not limited here).
Loads loads_at(const model::Vehicle& vehicle, const PeerOptions& options, const PeerState& state,
               const PerWing& voltage_V);

/// Sum of what the air does to both wings.
Wrench aerodynamic_wrench(const model::Vehicle& vehicle, const PeerState& state, const Loads& loads);

/// A rotation by the unit quaternion `q_WB`, or back.
Vec3 to_world(const Quat& q_WB, const Vec3& v_B);
Vec3 to_body(const Quat& q_WB, const Vec3& v_W);

}  // namespace flappy::reference
