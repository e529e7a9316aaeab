// One robot as it is: its bodies, wings and motors with what is wrong with them, and the rates of its state.
//
// Torso, and on each side leading edge and wing, in reduced coordinates: the torso's twist in B and four hinge rates are the
// quasi-velocities. With S1, S2 the axes of a side as twists at the torso's origin, and bodies' inertias there (spatial.hpp):
//
//   A1 = V0 x S1 psi',  A2 = A1 + V1 x S2 theta'           what bodies are accelerated by where no quasi-velocity changes
//   f  = I A + V x* I V                                     and the wrench that this takes
//   M  from composite inertias: [S1 S2]^T (I_edge + I_wing | I_wing) ...
//   the hinges are eliminated first (2 x 2 for each side), then the torso is solved for (6 x 6)
//
// Accelerations are those against free fall, so that weight needs no term and the torso's is what an accelerometer feels.
//
// Drive of a side, in the stroke hinge's axis; the rotor turns against the wing (one pair of gears), so its momentum counts:
//   T = N K i - (1 - eta) N K |i| tanh(psi' / w_g) - N f tanh(N psi' / w_f) - b N^2 psi',     inertia N^2 J
//   L di/dt = V - R i - K N psi'
// The gear's loss is a friction that grows with load: unlike a factor on the torque it takes power in both directions.
//
// A stop is Hunt and Crossley's: k d^(3/2) (1 + 3/2 c d') where d is how far it is pressed in, never pulling.
//   Hunt, Crossley: Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
//
// Assumed, as no figure is published: L 0.2 mH (small motors of this resistance have 0.1 to 0.4), friction regularised over 6 rad/s of
// stroke, stops that a wing's impact presses in by about 3 degrees.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "blind/b/air.hpp"
#include "blind/b/effects.hpp"
#include "blind/b/figures.hpp"
#include "blind/b/spatial.hpp"

namespace flappy::blind::b {

inline constexpr double kInductance_H = 0.2e-3;
inline constexpr double kFrictionOver_rad_s = 6;                 ///< of a hinge, within which dry friction sets in
inline constexpr double kRotationStop = 2.0, kStrokeStop = 8.0;  ///< Nm/rad^1.5
/// s/rad: e = 1 - c d'. With a third of it wings bounce off their stops another way each beat.
inline constexpr double kStopLoss = 1e-2;

inline double smooth_sign(double x, double over) { return std::tanh(x / over); }

/// Where the quantities stand in a state.
enum Place : std::size_t {
  kPosition = 0,    // of the torso's origin in W
  kQuaternion = 3,  // w, x, y, z
  kRate = 7,        // of the torso in B
  kVelocity = 10,   // of its origin in B
  kStroke = 13,     // left, right; as all that follow
  kRotation = 15,
  kStrokeRate = 17,
  kRotationRate = 19,
  kRotor = 21,  // rotor over gear ratio, where it has play
  kRotorRate = 23,
  kLag = 25,  // two of each side
  kWake = 29,
  kTwist = 31,
  kBending = 33,
  kBristle = 35,
  kScrew = 37,
  kScrewRate = 38,
  kStates = 39,
};
using State = std::array<double, kStates>;

/// What holds during a step, or changes slowly.
struct Slow {
  std::array<double, 2> resistance_ohm{}, torque_constant_Nm_A{};
  std::array<double, 2> stop_shift_rad{}, stiffness{1, 1};
  double extra_damping = 0;  ///< of the springs, against critical
  Vector3d wind_m_s = Vector3d::Zero();
};

struct Surroundings {
  double ground_z_m = 0, ceiling_z_m = 2, wall_y_m = 1;
  double gravity_m_s2 = kGravity_m_s2;
};

/// The torso as it is moved by others.
struct Prescribed {
  Twist acceleration;  ///< against free fall, components in B
};

/// What comes with the rates.
struct Felt {
  Twist
      acceleration;  ///< of the torso, against free fall: w is the turning acceleration, v that of the origin less w x v
  Wrench support;    ///< that a prescribed motion takes, about the torso's origin in B
  Twist motion;      ///< of the torso, at which this was felt

  /// Specific force at a place of the torso, in B.
  Vector3d at(const Vector3d& place) const {
    const Vector3d& w = motion.w;
    return acceleration.v + w.cross(motion.v) + acceleration.w.cross(place) + w.cross(w.cross(place));
  }
};

class Plant {
 public:
  Plant(Figures figures, const Ailments& ailments);

  /// Rates of a state with these currents. With `prescribed`, the hinges alone are solved for.
  void rates(const State& x, const std::array<double, 2>& current_A, const Slow& slow, const Surroundings& room,
             const Prescribed* prescribed, State& rate, Felt& felt) const;

  /// Kinetic energy, energy of the springs and of weight.
  double energy_J(const State& x, const Surroundings& room) const;
  /// Momentum and moment of momentum about the origin of W, in W.
  Wrench momentum_W(const State& x) const;

  /// Back voltage over stroke rate: torque constant times ratio.
  double ratio(const State& x, std::size_t side) const;
  Slow fresh() const;

  const Figures& figures() const { return f_; }
  const Ailments& ailments() const { return a_; }
  const WingAir& wing(std::size_t side) const { return wing_[side]; }
  bool has_air = true, has_friction = true;  ///< tests do without

 private:
  struct SideNow;
  void place(const State& x, std::size_t side, SideNow& now) const;
  double hinge_torque(const Hinge& hinge, double angle, double rate, double stiffness, double restitution,
                      double shift) const;
  double stroke_torque(const State& x, std::size_t side, double current_A, const Slow& slow, State& rate) const;
  double spring_torque(std::size_t side, double stroke_rad, double stiffness) const;
  double spring_energy(std::size_t side, double stroke_rad) const;
  double near_gain(const Vector3d& shoulder_W, const Vector3d& tip_W, const Surroundings& room) const;
  Wrench on_torso(const State& x, const Matrix3d& R, const Slow& slow, const Surroundings& room) const;

  Figures f_;
  Ailments a_;
  std::array<WingAir, 2> wing_;
  Inertia torso_;
  std::array<double, 2> spread_rad_;  ///< of the hardening spring
};

Matrix3d rotation_matrix(const State& x);

}  // namespace flappy::blind::b
