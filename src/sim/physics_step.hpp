// One physics step of a flapper, stage by stage: where it is, what acts on it, new rates, new positions.
#pragma once

#include "model/effects/registry.hpp"
#include "model/motor.hpp"
#include "model/vehicle_dynamics.hpp"
#include "model/wing_aerodynamics.hpp"
#include "sim/block.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

using namespace model;

/// What is the same for all steps of a block.
template <class T>
struct Constants {
  T step, half_step, per_step, gravity, ground_z, ceiling_z;
};

/// Effects in force, with their parameters in lanes. Every lane of a block has the same set.
template <class T>
struct ActiveEffects {
  std::uint64_t set = 0;
  T parameters[kEffectRows];

  /// Calls `stage(effect, its parameters)` for every effect in force.
  template <class Stage, int I = 0>
  FLAPPY_INLINE void apply(const Stage& stage) const {
    if constexpr (I < kEffects) {
      using Effect = std::tuple_element_t<I, Effects>;
      constexpr int kCount = static_cast<int>(Effect::kParameters.size());
      if (set >> I & 1) stage(Effect{}, *reinterpret_cast<const T(*)[kCount]>(parameters + effect_rows_before<I>()));
      apply<Stage, I + 1>(stage);
    }
  }
};

/// What air and motor do to one side.
template <int side, class T>
FLAPPY_INLINE SideLoad<T> load_side(const SideParameters<T>& p, const SideState<T>& q, const WingWrench<T>& air,
                                    const T& voltage_V) {
  SideLoad<T> load;
  load.force_x_N = air.force_x_N;
  load.force_z_N = air.force_z_N;
  load.moment_Nm = air.moment_Nm;
  load.stroke_torque_Nm = air.moment_Nm.z + T(side) * drive_torque(p, q, voltage_V);
  load.rotation_torque_Nm = air.moment_Nm.y - p.rotation_damping_Nm_s * q.rotation_rate_rad_s;
  return load;
}

/// Air on one wing, from the velocity of its shoulder in B.
template <int side, class T>
FLAPPY_INLINE WingWrench<T> air_on_wing(const SideParameters<T>& p, const WingPose<T>& g, const Vec3<T>& velocity_B) {
  return blade_element<side>(p, g.theta, g.theta_rate, turn_back_z(g.beta.sin, g.beta.cos, velocity_B),
                             {g.body_rate_L.x, g.body_rate_L.y, g.body_rate_L.z + g.beta_rate});
}

/// Turns the hinges of one side. The last clamp takes the rounding of a landing on a stop.
template <int side, class T>
FLAPPY_INLINE void turn(const SideParameters<T>& p, SideState<T>& q, const T& beta, const T& theta, const T& per_step) {
  q.stroke_rate_rad_s = T(side) * T(beta * per_step);
  q.rotation_rate_rad_s = theta * per_step;
  q.stroke_rad = clamp(T(q.stroke_rad + T(T(side) * beta)), p.stroke_lower_rad, p.stroke_upper_rad);
  q.rotation_rad = clamp(T(q.rotation_rad + theta), p.rotation_lower_rad, p.rotation_upper_rad);
}

/// Lets effects scale the air on the wings and load the body.
template <class T>
FLAPPY_INLINE void apply_effects(const ActiveEffects<T>& effects, const Surroundings<T>& s, Sides<WingWrench<T>>& air,
                                 BodyLoad<T>& body) {
  AirFactor<T> factor{T(1), T(1)};
  effects.apply([&](auto effect, const auto& parameters) {
    if constexpr (requires { effect.air(parameters, s, factor); }) effect.air(parameters, s, factor);
    if constexpr (requires { effect.world(parameters, s, body); }) effect.world(parameters, s, body);
  });
  air = {scaled(air.left, factor.left), scaled(air.right, factor.right)};
}

/// A held body goes where its support is. A standing one leaves when its wings carry it: true for lanes still held.
template <class T>
FLAPPY_INLINE typename T::Mask hold(const Parameters<T>& p, State<T>& x, const WholeVehicle<T>& whole,
                                    const Matrix3<T>& R, Vec3<T>& com_m, const T& gravity) {
  const auto held = x.support > T(0);
  if (!rarely(held)) return held;
  com_m = where(held, x.position_m + R * whole.com, com_m);
  x.com_velocity_m_s = where(held, R * whole.com_rate, x.com_velocity_m_s);
  const auto carried = (x.support == T(1)) & (x.lift_N * p.inverse_mass_1_kg > gravity);
  x.support = where(carried, T(-1), x.support);
  return x.support > T(0);
}

/// What holds the body feels the air on the wings.
template <class T>
FLAPPY_INLINE void feel(const Parameters<T>& p, State<T>& x, const Sides<WingPose<T>>& pose,
                        const Sides<WingWrench<T>>& air, const T& lift, const T& step, typename T::Mask held) {
  if (!rarely(held)) return;
  const auto force = [](const WingPose<T>& g, const WingWrench<T>& a) {
    return turn_z(g.beta.sin, g.beta.cos, a.force_x_N, a.force_z_N);
  };
  const auto moment = [](const WingPose<T>& g, const WingWrench<T>& a) {
    return turn_z(g.beta.sin, g.beta.cos, a.moment_Nm);
  };
  const Vec3<T> force_l = force(pose.left, air.left), force_r = force(pose.right, air.right);
  const Vec3<T> about_origin = (moment(pose.left, air.left) + moment(pose.right, air.right)) +
                               (cross(p.left.shoulder_m, force_l) + cross(p.right.shoulder_m, force_r));
  x.impulse_N_s = where(held, add_scaled(x.impulse_N_s, step, force_l + force_r), x.impulse_N_s);
  x.angular_impulse_Nm_s = where(held, add_scaled(x.angular_impulse_Nm_s, step, about_origin), x.angular_impulse_Nm_s);
  x.lift_N = where(held, T(x.lift_N + T(lift - x.lift_N) / p.beat_steps), x.lift_N);
}

/// One physics step. `com_m`: the vehicle's centre of mass in W, carried along because it is what inertia moves.
template <bool with_effects, class T>
FLAPPY_INLINE void physics_step(const Parameters<T>& p, State<T>& x, const Voltages<T>& voltages, Vec3<T>& com_m,
                                const ActiveEffects<T>& effects, const Constants<T>& k) {
  // where everything is and how it moves
  const Matrix3<T> R = rotation_matrix(x.attitude);
  const Vec3<T>& w = x.body_rate_rad_s;
  const Sides<WingPose<T>> pose{place_wing<+1>(p.left, x.left, w), place_wing<-1>(p.right, x.right, w)};
  const WholeVehicle<T> whole = whole_vehicle(p, pose);
  const auto held = hold(p, x, whole, R, com_m, k.gravity);

  // what acts on it: air, effects beyond the base model, motors
  const Vec3<T> v_C = transpose_times(R, x.com_velocity_m_s) - whole.com_rate;
  Sides<WingWrench<T>> air{air_on_wing<+1>(p.left, pose.left, v_C + cross(w, whole.arm_left)),
                           air_on_wing<-1>(p.right, pose.right, v_C + cross(w, whole.arm_right))};
  BodyLoad<T> body{{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  if constexpr (with_effects) {
    const T stroke_plane = T(0.5) * T(p.left.shoulder_m.z + p.right.shoulder_m.z);
    apply_effects(effects,
                  {R, com_m - R * whole.com, v_C - cross(w, whole.com), w, whole.com, stroke_plane, p.air_density_kg_m3,
                   k.ground_z, k.ceiling_z},
                  air, body);
  }
  const Sides<SideLoad<T>> load{load_side<+1>(p.left, x.left, air.left, voltages.left_V),
                                load_side<-1>(p.right, x.right, air.right, voltages.right_V)};

  // new rates
  const Sides<WingInertia<T>> wing{wing_inertia(p.left, pose.left), wing_inertia(p.right, pose.right)};
  const BodyInertia<T> inertia = body_inertia(p, x, pose, wing, whole);
  const BodyDrive<T> body_drive = drive_body(p, x, pose, wing, whole, inertia, load, body, R.row_z, k.gravity);
  const HingeSystem<T> hinges = eliminate_body(p, pose, wing, whole, inertia, body_drive, load);
  const Motion<T> m = move(p, x, inertia, body_drive, hinges, k.step, k.per_step);
  const Vec3<T> force = R * body_drive.force;
  x.body_rate_rad_s = add_scaled(w, k.step, m.body_acceleration);
  x.com_velocity_m_s = add_scaled(x.com_velocity_m_s, T(k.step * p.inverse_mass_1_kg), force);
  x.com_velocity_m_s.z -= k.step * k.gravity;

  // new positions, with the new rates
  turn<+1>(p.left, x.left, m.stroke_left, m.rotation_left, k.per_step);
  turn<-1>(p.right, x.right, m.stroke_right, m.rotation_right, k.per_step);
  com_m = add_scaled(com_m, k.step, x.com_velocity_m_s);
  x.attitude = turned(x.attitude, k.half_step * x.body_rate_rad_s);
  feel(p, x, pose, air, force.z, k.step, held);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
