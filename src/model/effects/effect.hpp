// Each effect beyond the base model is one file in this folder: a struct with
//   kInfo                id, stage, number of magnitudes, group, source
//   kParameters          names with units, and ranges: magnitudes first, then shape parameters
//   kStates              number of rows of memory from step to step, 0 at a reset; an effect without memory omits it
//   one or more stages   static templates that change the result of a stage of the step
// and one line in registry.hpp. Simulation, randomisation, the vehicle file and diagnosis all read that one
// description. A stage is found by its name; an effect without it costs nothing there. In the order of a step:
//   vehicle(parameters, Vehicle&)                            the vehicle, before constants are derived from it
//   motor(parameters, surroundings, state, Sides<Hinges>&)   rate of each motor, if it differs from that of its wing
//   hinges(parameters, surroundings, state, Sides<Hinges>&)  motors, springs and stops of both sides
//   wind(parameters, surroundings, state, Vec3&)             velocity of the air, in B
//   air<side>(parameters, surroundings, state, WingWrench&)  force and moment of the air on a wing
//   world(parameters, surroundings, state, BodyLoad&)        loads on the body in addition to those of its wings
//   after(parameters, surroundings, state, Sides<Hinges>)    updates the memory at the end of the step
// In a lane in which all magnitudes of an effect are 0, the result of the stage stays the same to the bit.
#pragma once

#include <array>

#include "model/vehicle_dynamics.hpp"
#include "model/wing_aerodynamics.hpp"

namespace flappy::model {

struct Vehicle;

/// The stage of the step in which an effect acts. body: it changes the vehicle itself, which costs the step nothing.
enum class Stage { body, drive, wing, air, world, sensor };
inline constexpr std::size_t kStages = 6;
const char* name_of(Stage stage);

struct EffectParameter {
  const char* name;   ///< including the unit as suffix
  double low, high;   ///< accepted in a vehicle file
  double typical;     ///< value of an effect that is switched on without a value
  double prior_low;   ///< 90 % of the prior probability lies
  double prior_high;  ///<   between these
};

struct EffectInfo {
  const char* id;
  Stage stage;
  int magnitudes;  ///< number of leading parameters that are magnitudes: the effect vanishes, to the bit, when all of them are 0
  const char* group;  ///< group of effects that short or gentle flights cannot tell apart, or ""
  const char* source;
};

inline namespace FLAPPY_ISA {

template <class T>
struct SideConstants {
  T resistance_ohm, back_emf_V_s;  // of the motor, the latter per stroke rate
  T electric_damping_Nm_s;         // share of the back-EMF in the stroke damping
  T rotor_spin_kg_m2;              // S of motor.hpp
  T wing_length_m, mean_chord_m;
  // added mass of strips, rho pi/4 c^2 each: its integral, and its integrals times c/2, r, c^2/4 + c^2/32, r^2, r c/2
  T added_kg, added_chord_kg_m, added_span_kg_m, added_chord2_kg_m2, added_span2_kg_m2, added_cross_kg_m2;
};

/// Motor, gear, spring and stops of one side in a step. Torques are about beta and theta.
template <class T>
struct Hinges {
  T source_share;      // voltage of the battery as a share of its nominal voltage
  T voltage_V;         // at the motor
  T motor_rate_rad_s;  // phi', about the stroke axis; psi' if the gear has no play; known from hinges() on
  T resistance_ohm, torque_per_V_Nm, damping_Nm_s, stiffening_kg_m2, friction_Nm, rotor_kg_m2;  // as in SideParameters
  T spring_positive_Nm_rad, spring_negative_Nm_rad;
  T rotation_lower_rad, rotation_upper_rad;
  // added by effects; initially -0, because adding -0 changes no bit of a sum
  T stroke_torque_Nm, rotation_torque_Nm, rotation_inertia_kg_m2, cross_inertia_kg_m2;
};

template <class T>
struct Surroundings {
  const Parameters<T>& p;
  const State<T>& x;  // in after(): at the end of the step; all other members are at its start
  const Sides<WingPose<T>>& pose;
  const Sides<SideConstants<T>>& constants;
  Matrix3<T> attitude;     // R_WB
  Vec3<T> position_m;      // torso origin, in W
  Vec3<T> velocity_B_m_s;  // of the torso origin, in B
  Vec3<T> com_m;           // the vehicle's centre of mass from the torso origin, in B
  T stroke_plane_m;        // height of the shoulders above the torso origin along z of B
  T step_s, per_step, gravity;
  T ground_z_m, ceiling_z_m;
  T wall_clearance_m, wall_normal_x, wall_normal_y;  // of the torso origin to the nearest wall
  Vec3<T> wind_B_m_s;                                // velocity of the air; known from air() on
  Sides<Vec3<T>> shoulder_B_m_s;                     // of the shoulders in that air, in B; known from air() on
  T lift_N;                                          // of both wings along z of B; known from world() on
};

/// An effect's rows of memory. Lanes in which its magnitudes are 0 keep theirs unchanged.
template <class T>
struct StateRows {
  Element<T>* rows;
  int stride;
  typename T::Mask on;

  FLAPPY_INLINE T get(int row) const { return T::load(rows + row * stride); }
  FLAPPY_INLINE void set(int row, const T& value) const { where(on, value, get(row)).store(rows + row * stride); }
  /// Adds to a compensated sum (Kahan 1965) in `row` and `row + 1`: small increments survive in single precision.
  FLAPPY_INLINE void add(int row, const T& increment) const {
    const T sum = get(row), more = increment - get(row + 1);
    const T next = sum + more;
    set(row, next);
    set(row + 1, T(next - sum) - more);
  }
};

// Lane-by-lane choice between results of stages, member by member so that compilers keep them in registers.

template <class T>
FLAPPY_INLINE Hinges<T> where(auto m, const Hinges<T>& a, const Hinges<T>& b) {
  return {where(m, a.source_share, b.source_share),
          where(m, a.voltage_V, b.voltage_V),
          where(m, a.motor_rate_rad_s, b.motor_rate_rad_s),
          where(m, a.resistance_ohm, b.resistance_ohm),
          where(m, a.torque_per_V_Nm, b.torque_per_V_Nm),
          where(m, a.damping_Nm_s, b.damping_Nm_s),
          where(m, a.stiffening_kg_m2, b.stiffening_kg_m2),
          where(m, a.friction_Nm, b.friction_Nm),
          where(m, a.rotor_kg_m2, b.rotor_kg_m2),
          where(m, a.spring_positive_Nm_rad, b.spring_positive_Nm_rad),
          where(m, a.spring_negative_Nm_rad, b.spring_negative_Nm_rad),
          where(m, a.rotation_lower_rad, b.rotation_lower_rad),
          where(m, a.rotation_upper_rad, b.rotation_upper_rad),
          where(m, a.stroke_torque_Nm, b.stroke_torque_Nm),
          where(m, a.rotation_torque_Nm, b.rotation_torque_Nm),
          where(m, a.rotation_inertia_kg_m2, b.rotation_inertia_kg_m2),
          where(m, a.cross_inertia_kg_m2, b.cross_inertia_kg_m2)};
}
template <class T>
FLAPPY_INLINE Sides<Hinges<T>> where(auto m, const Sides<Hinges<T>>& a, const Sides<Hinges<T>>& b) {
  return {where(m, a.left, b.left), where(m, a.right, b.right)};
}
template <class T>
FLAPPY_INLINE WingWrench<T> where(auto m, const WingWrench<T>& a, const WingWrench<T>& b) {
  return {where(m, a.normal_force_N, b.normal_force_N), where(m, a.force_x_N, b.force_x_N),
          where(m, a.force_z_N, b.force_z_N), where(m, a.moment_Nm, b.moment_Nm)};
}
template <class T>
FLAPPY_INLINE BodyLoad<T> where(auto m, const BodyLoad<T>& a, const BodyLoad<T>& b) {
  return {where(m, a.force_B, b.force_B), where(m, a.moment_B, b.moment_B)};
}

template <int side, class S>
FLAPPY_INLINE auto& of_side(S& s) {
  if constexpr (side > 0) return s.left;
  else return s.right;
}

/// Flow at a wing: velocity of its shoulder in the air, and angular velocity of its leading edge's frame E, both in E.
template <class T>
struct WingFlow {
  Vec3<T> v, w;
};
template <int side, class T>
FLAPPY_INLINE WingFlow<T> flow(const Surroundings<T>& s) {
  const WingPose<T>& g = of_side<side>(s.pose);
  return {rotate_back_z(g.beta.sin, g.beta.cos, of_side<side>(s.shoulder_B_m_s)),
          {g.body_rate_L.x, g.body_rate_L.y, g.body_rate_L.z + g.beta_rate}};
}

template <class T>
FLAPPY_INLINE T stroke_plane_z(const Surroundings<T>& s) {
  return s.position_m.z + s.attitude.row_z.z * s.stroke_plane_m;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
