// One robot in MuJoCo: an MJCF text of its parameters, one mjModel and one mjData. A wing has two ellipsoids of the
// fluid model [1], at nodes and with areas of the Gauss quadrature for the planform's moments r00, r11, r22, r33: force
// and moment about the shoulder are the whole planform's where of second degree in the radius. Chord: of an ellipse of
// the wing's length and area, its middle 0.55 mean chords behind the leading edge. Without the effect added_mass a wing has
// no virtual mass: MuJoCo's model has only the products of velocities of its force, and those alone would be no fluid's.
// With it, a law of our own (c_laws.hpp) takes their place. Up to 3.13 MuJoCo's lift has a floor of 1e-15 in a denominator,
// which takes lift from these wings below 0.8 m/s: other versions have other robots (Family::engine).
// Clamped: with a mass A and a moment of inertia added to the six coordinates t of the torso, and w the others,
//   (M_tt + A) a_t + M_tw a_w = f_t,
// the torso stays where it is as A grows, and A a_t tends to f_t - M_tw a_w, which it exerts on its support [2]: weight
// and air, less the rate of change of the wings' momentum. No second law is needed, and the stops yield as in flight.
// [1] MuJoCo documentation, Computation, Fluid forces: ellipsoid model; after Andersen, Pesavento, Wang, J. Fluid Mech.
// 541 (2005).
// [2] Featherstone, Rigid Body Dynamics Algorithms (Springer 2008), chapter 9: hybrid dynamics, where the motion of some
// coordinates is given and their forces are sought. A large A gives them to a share M_tt / A.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

#include "lab/blind/c/c_effects.hpp"
#include "lab/blind/c/c_robot_parameters.hpp"

namespace flappy::blind::c {

/// Changes to the bodies by effects, drawn once for a robot.
struct Build {
  double damage = 0;                 ///< share of the outer ellipse's area
  std::size_t damaged = 0;           ///< side with the damage
  double backlash_rad = 0;           ///< 0: the rotor is rigidly coupled to the stroke hinge
  double spar_stiffness_Nm_rad = 0;  ///< 0: rigid
  double leg_mass_kg = 0;            ///< 0: part of the torso
  double body_drag_m2 = 0;           ///< C_d A of the torso
  double rotational_lift = 0;        ///< share of kRotation
  double added_mass = 0;             ///< share of the virtual mass
  double stop_softness = 0;          ///< of the stops of the rotation
};

// Constants of effects at magnitude 1.
// Body drag: C_d A, broadside, as of a cylinder with C_d 1.4 (choice) and the torso's ellipse of 13 x 22 mm; slender and
// angular coefficients of MuJoCo's model over the blunt one's and by themselves (choice).
inline constexpr double kBodyDrag_m2 = 1.26e-3, kBodySlender = 0.41, kBodyAngular = 0.17;
// Circulation of a rotating wing, pi (0.75 - x0) thetadot c^2 (Sane, Dickinson, J. Exp. Biol. 205, 1087, 2002), here of the
// ellipses' chord, which the hinge divides at x0 from the front: (2/pi - 0.55) / (4/pi).
inline constexpr double kRotationAxis = 0.068, kRotation = M_PI * (0.75 - kRotationAxis);
// Damage: share of the outer ellipse's area, lost at its tip. Hawkmoths may need no active compensation up to 12 % of
// asymmetry in the second moment of area (Fernandez, Springthorpe, Hedrick, J. Exp. Biol. 215, 3631, 2012); choice below.
inline constexpr double kDamage = 0.043, kDamage_m = 1.351e-3;  ///< of area, and of the nominal wing's length
// Virtual mass along the normal of both ellipsoids of the nominal wing at small speeds: what MuJoCo derives.
inline constexpr double kVirtual_kg = 2.2503e-5;
// Play of the gear at the wing: choice, 80 um at a pitch radius of 5.6 mm. The teeth are a soft constraint of MuJoCo.
inline constexpr double kBacklash_rad = 0.0143, kTeethTime_s = 2.3e-4, kTeethDamping = 0.86;
// Softened stops, as of rubber: stiffness over 1 + 2.7 m, and an impedance that rises over an angle from a low one (MuJoCo
// documentation, Modeling, Solver parameters). Choice.
inline constexpr double kStopSoftness = 2.7, kStopFirst = 0.41, kStopRise_rad = 0.13;

struct Wrench {
  Eigen::Vector3d force_W = Eigen::Vector3d::Zero(), torque_W = Eigen::Vector3d::Zero();
};

struct Motion {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), rate_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_W = Eigen::Vector3d::Zero(),
                  turning_B = Eigen::Vector3d::Zero();  ///< accelerations of the previous step
};

class Mechanism {
 public:
  /// Semi-implicit Euler, first order. Errors against a quarter of this step, in hover with the torso held: mean thrust
  /// 0.2 % of the weight, first harmonics 1 %, stroke 0.06 %.
  static constexpr double kStep_s = 5e-5;
  static constexpr double kGravity_m_s2 = 9.81;
  /// Ellipsoids of a wing; 0 is nearest to the shoulder.
  static constexpr std::size_t kStrips = 2;

  Mechanism(const RobotParameters& parameters, const Build& build, double step_s = kStep_s);

  mjModel& model() { return *model_; }
  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

  Motion motion() const;
  double stroke(std::size_t side) const { return data_->qpos[stroke_q_[side]]; }
  double stroke_rate(std::size_t side) const { return data_->qvel[stroke_v_[side]]; }
  double rotation(std::size_t side) const { return data_->qpos[rotation_q_[side]]; }
  double rotation_rate(std::size_t side) const { return data_->qvel[rotation_v_[side]]; }
  /// Angle and rate of the rotor, behind the gear.
  double drive_angle(std::size_t side) const { return data_->qpos[drive_q_[side]]; }
  double drive_rate(std::size_t side) const { return data_->qvel[drive_v_[side]]; }
  /// Torque of all passive forces, almost all of the air, about the rotation hinge in the previous step.
  double hinge_torque(std::size_t side) const { return data_->qfrc_passive[rotation_v_[side]]; }
  Eigen::Vector3d strip_position(std::size_t side, std::size_t strip) const;
  bool is_finite() const;

  void place(const Eigen::Vector3d& position_W, const Eigen::Quaterniond& q_WB);
  void move_torso(const Motion& motion);
  void set_wind(const Eigen::Vector3d& wind_W);
  void scale_air(std::size_t side, std::size_t strip, double factor);
  /// Rotates the outermost ellipsoid about the span.
  void twist(std::size_t side, double angle_rad);
  void set_friction(std::size_t side, double torque_Nm);

  /// Generalised force (N, Nm) of the virtual mass on all coordinates, at these accelerations, in steady wind.
  Eigen::VectorXd virtual_mass_load(const Eigen::VectorXd& accelerations) const;
  /// Energy of the air that the virtual mass stands for, J.
  double virtual_mass_energy() const;

  /// Advances one step. Motor torques are behind the gear; `wrench` acts on the torso at its origin. `held` prescribes
  /// the torso's acceleration; motion() still returns that of a free torso.
  void step(const std::array<double, 2>& motor_Nm, const std::array<double, 2>& spring_Nm, const Wrench& wrench,
            const Motion* held = nullptr);

  /// Clamps the torso where it is, for good.
  void clamp();
  /// What the clamped robot exerted on its support in the previous step, about the torso's origin: its weight, the air's
  /// forces, and less the rate of change of the wings' momentum.
  const Wrench& support() const { return support_; }

 private:
  struct Carried;
  Carried carried(std::size_t side, std::size_t strip) const;
  std::array<Carried, 2 * kStrips> all_carried() const;
  void add_virtual_mass();
  Eigen::VectorXd virtual_mass_bias() const;
  Eigen::VectorXd virtual_mass_products() const;
  void hold_torso(const Motion& held);

  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::array<int, 2> stroke_q_{}, stroke_v_{}, rotation_q_{}, rotation_v_{}, drive_q_{}, drive_v_{};
  std::array<std::array<std::ptrdiff_t, kStrips>, 2> strips_{};
  std::array<std::array<double, 4>, 2> strip_quat_{};
  bool added_mass_ = false;
  std::array<std::array<double, kStrips>, 2> virtual_m3_{};  ///< along the normal at small speeds, over the density
  std::array<std::array<Eigen::Vector3d, kStrips>, 2> virtual_m5_{};  ///< moments of inertia over the density
  std::array<double, 2> growth_m_s_{};                                ///< v0 of the virtual mass
  bool clamped_ = false;
  Motion clamp_;
  Wrench support_;
};

/// Ellipsoid of a wing: radius over wing length, and area over length times mean chord.
struct Strip {
  double radius, area;
};
std::array<Strip, Mechanism::kStrips> strips_of(const Planform& planform);
/// Half of an ellipse's length, over the wing's.
double half_length(const Strip& strip);
/// The outer ellipse without a share of its area at its tip; the inner end stays.
Strip damaged_tip(const Strip& tip, double share);
/// Chord of all ellipses at a radius over the wing's length, over the mean chord.
double chord_at(const std::array<Strip, Mechanism::kStrips>& strips, double radius);

}  // namespace flappy::blind::c
