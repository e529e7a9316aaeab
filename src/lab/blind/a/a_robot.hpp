// The blind robot: a second simulator of the vehicle that replaces the real robot in tests of a diagnosis: five rigid
// bodies (torso; on each side leading edge and wing), ten degrees of freedom. Written from published parameters, with a
// force law of the wing of its own (a_air.cpp). Unknowns x of a step, in B: accelerations of torso and joints:
//   sum of J^T (m, I) J  x = forces - J^T (forces that the bodies need at x = 0)      J: Jacobian of a body's motion
// Wings are strips (planform.hpp). Semi-implicit Euler, 20 us; only the wings' stops are stiff at this step, and
// implicit.
#pragma once

#include <array>
#include <deque>
#include <vector>

#include "flappy/vehicle.hpp"
#include "lab/blind/a/a_effects.hpp"
#include "lab/blind/a/a_laws.hpp"
#include "lab/blind/a/maths.hpp"
#include "lab/blind/a/planform.hpp"

namespace flappy::blind {

inline constexpr double kRobotStep_s = 2e-5;
inline constexpr double kLiftStation = 0.6;  ///< share of the span at which surfaces are felt
inline constexpr double kBattery_V = 18;     ///< nominal: at this voltage the motor gets the commanded voltage

struct Wall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
};

struct Room {
  double gravity_m_s2 = 9.81, ground_z_m = 0, ceiling_z_m = 2;
  Wall wall{0, 1, 0, -1};
};

struct Torso {
  Vector3d position_m = Vector3d::Zero();  ///< origin, in W
  Quaterniond attitude = Quaterniond::Identity();
  Vector3d velocity_m_s = Vector3d::Zero();  ///< of the origin, in W
  Vector3d rate_rad_s = Vector3d::Zero();    ///< in B
};

struct Wing {
  double stroke_rad = 0, rotation_rad = 0, stroke_rad_s = 0, rotation_rad_s = 0;
};

struct RobotSideState {
  Wing wing;
  double rotor_rad = 0, rotor_rad_s = 0;  ///< of a motor with gear backlash, divided by the gear ratio
  laws::Filter driver;                    ///< output of a driver with finite bandwidth
  double motor_V = 0, current_A = 0;      ///< in the last step
  double winding_A = 0;                   ///< current that the bridge sees in its dead time
  laws::Heat heat;                        ///< temperatures of the motor
  double heat_J = 0;                      ///< since the last slow update
  laws::Wake wake;                        ///< low-passed stroke rate, for wake capture
  double twist_rad = 0;                   ///< at the tip
  double envelope_V = 0, play_V = 0;      ///< low-passed amplitude of the command; state of its hysteresis
  double resistance_gain = 1, flux_gain = 1, air_gain = 1, drive_gain = 1;  ///< of the last slow update
};

struct RobotState {
  double t_s = 0;
  Torso torso;
  std::array<RobotSideState, 2> side;  ///< left first
  double battery_V = kBattery_V, drawn_C = 0;
  laws::Battery battery;
  Vector3d wind_m_s = Vector3d::Zero();
  laws::Gust gust;
  Vector3d slosh_m = Vector3d::Zero(), slosh_m_s = Vector3d::Zero();
  double yaw_rate_rad_s = 0, sink_m_s = 0;  ///< low-passed
  double shedding_turns = 0, brush_left_s = 0;
  double density_gain = 1, fling = 0;
  double gap_rad = kPi, closest_gap_rad = kPi;    ///< between the wings; the smallest of this meeting
  Vector3d acceleration_m_s2 = Vector3d::Zero();  ///< of the torso origin in W, components in B; last step
  Vector3d turning_rad_s2 = Vector3d::Zero();
};

/// Of a strip: coefficients of the force along the wing's normal and of friction along the flow, both on the speed through
/// the air, and the centre of pressure in chords behind the leading edge. sin and cos of the angle of attack; a negative
/// sin: the air comes from behind.
struct WingSection {
  double normal, friction, centre;
};
WingSection wing_section(double sin_alpha, double cos_alpha);

/// Moment about the leading edge by rotation, over half the density, the width and the vehicle's rotational damping
/// coefficient. `across_m_s`: speed of the leading edge along the wing's x.
double rotation_drag(double chord_m, double across_m_s, double rotation_rad_s);

/// A joint's stop. `softness`: magnitude of what softens it.
struct Stop {
  double lower_rad, upper_rad, softness;
  laws::StopForce hard;
};

class Robot {
 public:
  /// `seed` draws directions and signs of effects; with `flight`, what differs between flights: gusts, jitter.
  /// `swapped_wings`: damage is on the other side, as `vehicle` has the wings swapped.
  Robot(const model::Vehicle& vehicle, const Room& room, const Magnitudes& magnitudes, std::uint64_t seed,
        std::uint64_t flight = 0, double step_s = kRobotStep_s, bool swapped_wings = false);

  /// Advances one step. The arguments command the driver, in V at nominal battery voltage.
  void step(double left_V, double right_V);

  /// Moves the torso; all other states, as wings, currents and heat, stay.
  void place_torso(const Torso& torso) { x_.torso = torso; }
  /// Exchanges the battery for a full one, of kBattery_V if never called.
  void charge(double full_V) { x_.battery_V = full_V_ = full_V; }
  /// Fixes the torso, as on a test stand.
  void hold_torso(bool held) { held_ = held; }

  const RobotState& state() const { return x_; }
  void set_state(const RobotState& state) { x_ = state; }
  const Torso& torso() const { return x_.torso; }
  const Wing& wing(std::size_t side) const { return x_.side[side].wing; }
  double battery_V() const { return x_.battery_V; }
  double current_A(std::size_t side) const { return x_.side[side].current_A; }
  double step_s() const { return step_s_; }
  const Room& room() const { return room_; }
  double mass_kg() const { return mass_kg_; }
  Stop rotation_stop(std::size_t side) const;

  /// Specific force (m/s^2) at a point of B in the last step, in B.
  Vector3d specific_force(const Vector3d& point_m) const;

  struct Wrench {
    Vector3d force_N = Vector3d::Zero(), moment_Nm = Vector3d::Zero();  ///< in B, about the torso origin
  };
  /// Wrench of the air on both wings in the last step, without added mass.
  const Wrench& air() const { return air_; }
  /// Moments about stroke and rotation axis of the added mass of one wing, at rest of the torso.
  std::array<double, 2> added_mass_moments(std::size_t side, double stroke_rad_s2, double rotation_rad_s2);

  struct Momentum {
    Vector3d linear_kg_m_s, angular_kg_m2_s;  ///< in W, about its origin
    double energy_J;                          ///< kinetic, including the rotors, and of the springs
  };
  Momentum momentum() const;

 private:
  using Matrix10 = Eigen::Matrix<double, 10, 10>;
  using Vector10 = Eigen::Matrix<double, 10, 1>;

  struct Body {
    double mass_kg = 0;
    Vector3d com_m = Vector3d::Zero();
    Matrix3d inertia_kg_m2 = Matrix3d::Zero();
  };
  struct Side {
    double sign;
    Body leading_edge, wing;
    Vector3d shoulder_m;
    model::Motor motor;
    model::Spring spring;
    model::Planform planform;
    model::Joint stroke, rotation;
    Stop stroke_stop, rotation_stop;
    Strips strips;
    std::array<double, kStrips> twist;  ///< shape of the twist along the span
  };
  /// Attitude and rates of a side's links, in B.
  struct Pose {
    Matrix3d edge, wing;  ///< rotation from the link's frame to B
    Vector3d stroke_axis, rotation_axis;
    Vector3d edge_rate, wing_rate;        ///< rad/s
    Vector3d edge_turning, wing_turning;  ///< angular acceleration at x = 0, rad/s^2
  };
  struct Column {
    Vector3d turn, shift;
  };

  void build_side(const model::Side& from, std::size_t side, bool damaged);
  void damage(Side& side);
  void pose_sides();
  template <int joints>
  void add_body(double mass_kg, const Matrix3d& inertia_B, const Vector3d& com, const Vector3d& rate,
                const Vector3d& turning, const Vector3d& acceleration, const std::array<Column, 2>& column, int first);
  void assemble();
  void add_joints();
  void add_stop(int joint, const Stop& stop, double angle_rad, double rate_rad_s);
  void add_force(const Vector3d& point_m, const Vector3d& force_N);
  void integrate();

  void drive(double left_V, double right_V);  // a_drive.cpp
  double motor_torque(std::size_t k);         //
  void update_drive(double dt_s);             //
  void blow();                                // a_air.cpp
  /// Calls use(mass, row, known) for each strip and for the plates' inertia: the air's inertia resists row . x + known.
  template <class Use>
  void for_added_masses(std::size_t k, const Use& use) const;  //
  void add_added_mass(std::size_t k);                          //
  void update_surroundings(double dt_s);                       // surroundings.cpp
  double place_gain(std::size_t k) const;                      //
  void push();                                                 //

  Room room_;
  Magnitudes magnitudes_;
  double step_s_, density_kg_m3_, mass_kg_ = 0, motion_gain_ = 1, full_V_ = kBattery_V;
  bool held_ = false;
  Body torso_;
  std::array<Side, 2> side_;
  int slow_steps_, until_slow_ = 0;

  // drawn once for a robot
  Vector3d wind_direction_, magnet_, field_, front_, shedding_axis_;
  double shedding_Hz_ = 0;
  Random gust_random_, delay_random_, brush_random_;
  struct Pending {
    double at_s;
    std::array<double, 2> volts;
  };
  std::deque<Pending> pending_;
  std::array<double, 2> told_V_{}, applied_V_{};

  RobotState x_;
  Matrix3d R_ = Matrix3d::Identity();  // from B to W, at the start of the step
  std::array<Pose, 2> pose_;
  Matrix10 mass_matrix_;
  Vector10 rhs_;
  Wrench air_;
};

}  // namespace flappy::blind
