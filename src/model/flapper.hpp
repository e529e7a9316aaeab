// Parameters (derived once from a Vehicle) and state of one flapper. Every member is a T, so a flapper is also a list
// of numbers: a block of lanes stores one row for each. Stroke and rotation are the published psi and theta; beta =
// side * psi turns about +z on both sides. L, frame of a leading edge: origin at the shoulder, B turned by beta.
#pragma once

#include "model/linear_algebra.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct SideParameters {
  Vec3<T> shoulder_m;         // in B
  Vec3<T> edge_moment_kg_m;   // leading edge: first moment of mass about the shoulder, in L
  Sym3<T> edge_second_kg_m2;  //   second moment
  Vec3<T> wing_moment_kg_m;   // wing: first moment about the shoulder, in the wing's frame
  Sym3<T> wing_second_kg_m2;
  T force2, force1, force0;     // 1/2 rho c R^(n+1) r_nn in F_N = C_N sum a_n force_n; force1 includes the 2 of a_1
  T moment2, moment1, moment0;  // same for M_aero
  T rotational_damping_Nm_s2;   // in M_rd
  T span_to_pressure_m;         // r_cp
  T stroke_torque_per_V_Nm;     // N eta K / R
  T stroke_damping_Nm_s;        // back-EMF, motor and joint damping
  T stroke_friction_Nm;         // of motor and joint
  T rotor_kg_m2;                // eta N^2 J, less S (motor.hpp)
  T voltage_limit_V;
  T spring_positive_Nm_rad, spring_negative_Nm_rad, spring_rest_rad;
  T stroke_lower_rad, stroke_upper_rad;
  T rotation_lower_rad, rotation_upper_rad;
  T rotation_damping_Nm_s, rotation_friction_Nm;
  T stroke_stiffening_kg_m2;  // implicit damping, as inertia added to the hinge: step/2 damping
};

template <class T>
struct Parameters {
  SideParameters<T> left, right;
  T inverse_mass_1_kg;
  Vec3<T> fixed_moment_kg_m;   // torso, and the wings' masses at the shoulders: first moment about the origin
  Sym3<T> fixed_second_kg_m2;  //   second moment
  T air_density_kg_m3;
  T below_m, above_m, around_m;  // distances from the origin
  T beat_steps;                  // steps in two wing beats, the time over which a support averages the lift
};

/// How a flapper is held, as a number, so that it can be a row like any other. The body does not move if it is above 0.
enum class Support { lifting = -1, none = 0, standing = 1, welded = 2 };

template <class T>
struct SideState {
  T stroke_rad, rotation_rad;
  T stroke_rate_rad_s, rotation_rate_rad_s;
  // rates a step earlier; the present ones after a reset without accelerations, and for a hinge that was on its stop
  T stroke_rate_before_rad_s, rotation_rate_before_rad_s;
};

template <class T>
struct State {
  Vec3<T> position_m;        // torso origin, in W
  Quaternion<T> attitude;    // body to world
  Vec3<T> com_velocity_m_s;  // velocity of the whole vehicle's centre of mass, in W: total momentum / mass
  Vec3<T> body_rate_rad_s;   // in B
  SideState<T> left, right;
  T support;                     // a Support, as a number
  T lift_N;                      // while standing: upward force of the wings, averaged over about two beats
  Vec3<T> impulse_N_s;           // while held: impulse of the air on the wings, in B
  Vec3<T> angular_impulse_Nm_s;  //   about the torso origin
};

/// Number of rows of a struct whose members are all T.
template <template <class> class S>
inline constexpr int kRows = sizeof(S<float>) / sizeof(float);

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
