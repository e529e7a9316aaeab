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
      if (set >> I & 1)
        stage(Effect{}, *reinterpret_cast<const T(*)[kCount]>(parameters + effect_rows_before<I>()));
      apply<Stage, I + 1>(stage);
    }
  }
};

/// What air and motor do to one side.
template <int side, class T>
FLAPPY_INLINE SideLoad<T> load_side(const SideParameters<T>& p, const SideState<T>& q,
                                    const WingWrench<T>& air, const T& voltage_V) {
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
FLAPPY_INLINE WingWrench<T> air_on_wing(const SideParameters<T>& p, const HingedWing<T>& g,
                                        const Vec3<T>& velocity_B) {
  return blade_element<side>(p, g.theta, g.theta_rate, turn_back_z(g.beta.sin, g.beta.cos, velocity_B),
                             {g.body_rate_L.x, g.body_rate_L.y, g.body_rate_L.z + g.beta_rate});
}

/// Turns the hinges of one side. The last clamp takes the rounding of a landing on a stop.
template <int side, class T>
FLAPPY_INLINE void turn(const SideParameters<T>& p, SideState<T>& q, const T& beta, const T& theta,
                        const T& per_step) {
  q.stroke_rate_rad_s = T(side) * T(beta * per_step);
  q.rotation_rate_rad_s = theta * per_step;
  q.stroke_rad = clamp(T(q.stroke_rad + T(T(side) * beta)), p.stroke_lower_rad, p.stroke_upper_rad);
  q.rotation_rad = clamp(T(q.rotation_rad + theta), p.rotation_lower_rad, p.rotation_upper_rad);
}

/// One physics step. `com_m`: the vehicle's centre of mass in W, carried along because it is what inertia
/// moves.
template <bool with_effects, class T>
FLAPPY_INLINE void physics_step(const Parameters<T>& p, State<T>& x, const Drive<T>& drive, Vec3<T>& com_m,
                                const ActiveEffects<T>& effects, const Constants<T>& k) {
  // where everything is and how it moves
  const Matrix3<T> R = rotation_matrix(x.attitude);
  const HingedWing<T> left = place_wing<+1>(p.left, x.left, x.body_rate_rad_s);
  const HingedWing<T> right = place_wing<-1>(p.right, x.right, x.body_rate_rad_s);
  const WholeVehicle<T> whole = whole_vehicle(p, left, right);
  auto held = x.support > T(0);
  if (rarely(held)) {
    com_m = where(held, x.position_m + R * whole.com, com_m);
    x.com_velocity_m_s = where(held, R * whole.com_rate, x.com_velocity_m_s);
    const auto carried = (x.support == T(1)) & (x.lift_N * p.inverse_mass_1_kg > k.gravity);
    x.support = where(carried, T(-1), x.support);  // a standing vehicle leaves when its wings carry it
    held = x.support > T(0);
  }

  // what the air does
  const Vec3<T> v_C = transpose_times(R, x.com_velocity_m_s) - whole.com_rate;
  WingWrench<T> air_left = air_on_wing<+1>(p.left, left, v_C + cross(x.body_rate_rad_s, whole.arm_left));
  WingWrench<T> air_right = air_on_wing<-1>(p.right, right, v_C + cross(x.body_rate_rad_s, whole.arm_right));
  BodyLoad<T> body{{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};

  // effects beyond the base model
  if constexpr (with_effects) {
    const Surroundings<T> s{R,
                            com_m - R * whole.com,
                            v_C - cross(x.body_rate_rad_s, whole.com),
                            x.body_rate_rad_s,
                            whole.com,
                            T(0.5) * T(p.left.shoulder_m.z + p.right.shoulder_m.z),
                            p.air_density_kg_m3,
                            k.ground_z,
                            k.ceiling_z};
    AirFactor<T> factor{T(1), T(1)};
    effects.apply([&](auto effect, const auto& parameters) {
      if constexpr (requires { effect.air(parameters, s, factor); }) effect.air(parameters, s, factor);
      if constexpr (requires { effect.world(parameters, s, body); }) effect.world(parameters, s, body);
    });
    air_left = scaled(air_left, factor.left);
    air_right = scaled(air_right, factor.right);
  }

  // new rates
  const SideLoad<T> load_left = load_side<+1>(p.left, x.left, air_left, drive.left_V);
  const SideLoad<T> load_right = load_side<-1>(p.right, x.right, air_right, drive.right_V);
  const BodyInertia<T> inertia = body_inertia(p, x, left, right, whole);
  const BodyDrive<T> body_drive =
      drive_body(p, x, left, right, whole, inertia, load_left, load_right, body, R.row_z, k.gravity);
  const HingeSystem<T> hinges =
      eliminate_body(p, left, right, whole, inertia, body_drive, load_left, load_right);
  const Motion<T> m = move(p, x, inertia, body_drive, hinges, k.step, k.per_step);
  const Vec3<T> force = R * body_drive.force;
  x.body_rate_rad_s = add_scaled(x.body_rate_rad_s, k.step, m.body_acceleration);
  x.com_velocity_m_s = add_scaled(x.com_velocity_m_s, T(k.step * p.inverse_mass_1_kg), force);
  x.com_velocity_m_s.z -= k.step * k.gravity;

  // new positions, with the new rates
  turn<+1>(p.left, x.left, m.stroke_left, m.rotation_left, k.per_step);
  turn<-1>(p.right, x.right, m.stroke_right, m.rotation_right, k.per_step);
  com_m = add_scaled(com_m, k.step, x.com_velocity_m_s);
  x.attitude = turned(x.attitude, k.half_step * x.body_rate_rad_s);

  // what holds the body feels the air
  if (rarely(held)) {
    const auto to_body = [](const HingedWing<T>& g, const Vec3<T>& v) {
      return turn_z(g.beta.sin, g.beta.cos, v);
    };
    const T none(0);
    const Vec3<T> force_l = to_body(left, {air_left.force_x_N, none, air_left.force_z_N});
    const Vec3<T> force_r = to_body(right, {air_right.force_x_N, none, air_right.force_z_N});
    const Vec3<T> moment = (to_body(left, air_left.moment_Nm) + to_body(right, air_right.moment_Nm)) +
                           (cross(p.left.shoulder_m, force_l) + cross(p.right.shoulder_m, force_r));
    x.impulse_N_s = where(held, add_scaled(x.impulse_N_s, k.step, force_l + force_r), x.impulse_N_s);
    x.angular_impulse_Nm_s =
        where(held, add_scaled(x.angular_impulse_Nm_s, k.step, moment), x.angular_impulse_Nm_s);
    x.lift_N = where(held, T(x.lift_N + T(force.z - x.lift_N) / p.beat_steps), x.lift_N);
  }
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
