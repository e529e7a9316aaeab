// Mechanics of one robot: torso, and on each side leading edge and wing, in reduced coordinates; the torso's twist in B
// and four hinge rates are quasi-velocities. With S1, S2 a side's axes as twists at the torso's origin, inertias there
// (spatial.hpp):
//   A1 = V0 x S1 psi',  A2 = A1 + V1 x S2 theta'           accelerations of the bodies while no quasi-velocity changes
//   f  = I A + V x* I V                                     and the wrench that they need
//   M  from composite inertias: [S1 S2]^T (I_edge + I_wing | I_wing) ...
//   the hinges are eliminated first (2 x 2 for each side), then the torso is solved for (6 x 6)
// Accelerations are relative to free fall: weight needs no term, and an accelerometer measures the torso's
// acceleration.
//
// Drive of a side, in the stroke hinge's axis; the rotor turns against the wing (one pair of gears), so its momentum
// counts:
//   T = N K i - (1 - eta) N K |i| tanh(psi' / w_g) - N f tanh(N psi' / w_f) - b N^2 psi',     inertia N^2 J
//   L di/dt = V - R i - K N psi'
// The gear's loss is friction that grows with load: unlike a factor on the torque, it dissipates in both directions.
//
// A stop, k d^(3/2) (1 + 3/2 c d') with the depth of penetration d, never pulls (Hunt, Crossley, Coefficient of
// restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)).
// Assumed, as unpublished: L 0.2 mH (small motors of this resistance: 0.1 to 0.4), friction regularised over 6 rad/s of
// stroke, stops that a wing's impact presses in by about 3 degrees.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "lab/blind/b/b_air.hpp"
#include "lab/blind/b/b_effects.hpp"
#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/b_robot_parameters.hpp"
#include "lab/blind/b/spatial.hpp"

namespace flappy::blind::b {

inline constexpr double kInductance_H = 0.2e-3;
inline constexpr double kFrictionOver_rad_s = 6;  ///< hinge rate over which dry friction is smoothed
/// Normal force of a wing, in the mean of its absolute value, in hover of the nominal robot; a test holds it to this.
inline constexpr double kHoverNormal_N = 0.09;
inline constexpr double kRotationStop = 2.0, kStrokeStop = 8.0;  ///< stiffness, Nm/rad^1.5
/// c of the stops, s/rad: the restitution is e = 1 - c d'. At a third of it, wings rebound differently in each beat.
inline constexpr double kStopLoss = 1e-2;

enum Place : std::size_t {
  kPosition = 0,    // of the torso's origin in W
  kQuaternion = 3,  // w, x, y, z
  kRate = 7,        // of the torso in B
  kVelocity = 10,   // of its origin in B
  kStroke = 13,     // left, right; so are the next ones
  kRotation = 15,
  kStrokeRate = 17,
  kRotationRate = 19,
  kRotor = 21,  // rotor angle over gear ratio, used with gear backlash
  kRotorRate = 23,
  kLag = 25,  // two for each side
  kWake = 29,
  kBend = 31,
  kBending = 33,
  kBristle = 35,
  kScrew = 37,
  kScrewRate = 38,
  kSlip = 39,  // deflection of the spring's part that is held by a slipping clamp
  kStates = 41,
};
using State = std::array<double, kStates>;

/// Parameters that are constant during a tick, as they change slowly.
struct Slow {
  std::array<double, 2> resistance_ohm{}, torque_constant_Nm_A{};
  std::array<double, 2> stop_shift_rad{}, stiffness{1, 1};
  double extra_damping = 0;  ///< of the springs, as a share of critical damping
  Vector3d wind_m_s = Vector3d::Zero();
};

struct Surroundings {
  double ground_z_m = 0, ceiling_z_m = 2, wall_y_m = 1;
  double gravity_m_s2 = kGravity_m_s2;
};

struct Prescribed {
  Twist acceleration;  ///< relative to free fall, components in B
};

/// By-products of the rates: the motion that the torso's sensors measure.
struct Felt {
  Twist
      acceleration;  ///< of the torso, relative to free fall: w: angular acceleration; v: acceleration of the origin less w x v
  Wrench support;  ///< external wrench that a prescribed motion needs, about the torso's origin in B
  Twist motion;    ///< of the torso at this instant

  /// Specific force at a point of the torso, in B (m/s^2).
  Vector3d at(const Vector3d& place) const {
    const Vector3d& w = motion.w;
    return acceleration.v + w.cross(motion.v) + acceleration.w.cross(place) + w.cross(w.cross(place));
  }
};

class Plant {
 public:
  Plant(RobotParameters parameters, const EffectMagnitudes& effect_magnitudes);

  /// Time derivative of a state at the given motor currents. With `prescribed`, only the hinges are solved for. `felt`
  /// must hold the previous call's acceleration, which drives a loose screw.
  void rates(const State& x, const std::array<double, 2>& current_A, const Slow& slow, const Surroundings& room,
             const Prescribed* prescribed, State& rate, Felt& felt) const;

  /// Moments (stroke axis, rotation axis) of the added mass of air on a wing of a torso that rests.
  std::array<double, 2> added_moments(std::size_t side, const State& x, double stroke_rad_s2,
                                      double rotation_rad_s2) const;
  /// Kinetic energy plus potential energy of springs and weight.
  double energy_J(const State& x, const Surroundings& room) const;
  /// Linear and angular momentum about the origin of W, in W.
  Wrench momentum_W(const State& x) const;

  Slow fresh() const;

  /// Where a state has the rotors' rates over the gear ratio: with play, they are not the wings'.
  std::size_t rotor_rate() const { return a_.any(kGearBacklash) ? kRotorRate : kStrokeRate; }

  const RobotParameters& parameters() const { return f_; }
  const EffectMagnitudes& effect_magnitudes() const { return a_; }
  const WingAir& wing(std::size_t side) const { return wing_[side]; }
  bool has_air = true, has_friction = true;  ///< tests switch these off

 private:
  struct SideNow;
  void place(const State& x, std::size_t side, SideNow& now) const;
  double hinge_torque(const Hinge& hinge, double angle, double rate, double stiffness, double restitution, double shift,
                      double pad) const;
  double stroke_torque(const State& x, std::size_t side, double current_A, const Slow& slow, State& rate) const;
  double spring_torque(std::size_t side, const State& x, double stiffness) const;
  double spring_energy(std::size_t side, const State& x) const;
  double near_gain(const Vector3d& shoulder_W, const Vector3d& tip_W, const Surroundings& room) const;
  Wrench on_torso(const State& x, const Matrix3d& R, const Slow& slow, const Surroundings& room) const;

  RobotParameters f_;
  EffectMagnitudes a_;
  std::array<WingAir, 2> wing_;
  Inertia torso_;
};

Matrix3d rotation_matrix(const State& x);

}  // namespace flappy::blind::b
