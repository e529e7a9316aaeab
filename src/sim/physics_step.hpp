// One physics step of a flapper, stage by stage: pose, loads, new rates, new positions.
#pragma once

#include "model/effects/registry.hpp"
#include "model/motor.hpp"
#include "model/vehicle_dynamics.hpp"
#include "model/wing_aerodynamics.hpp"
#include "sim/step.hpp"
#include "sim/touch.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

using namespace model;

template <class T>
struct Constants {
  T step, half_step, per_step, gravity, ground_z, ceiling_z;
};

/// What air and motor do to a wing in a step: the force of the air and its moment about the torso's origin, in B; lift and
/// drag, across and against the velocity of the axis at r_cp in the air; power that the wing gives to the air, and that the
/// motor gives behind its gear, before friction (docs/theory/model.md, section 3).
template <class T>
struct WingLoads {
  Vec3<T> force_N, moment_Nm;
  T lift_N, drag_N, aerodynamic_power_W, mechanical_power_W;
};

/// Effects in force in a block. All lanes share the set; magnitudes may be 0 in some lanes.
template <class T>
struct ActiveEffects {
  std::uint64_t set = 0, kept = 0;  // effects in force; effects with memory in the batch
  Element<T>* states = nullptr;     // of the first lane
  int stride = 0;
  const Wall* walls = nullptr;
  std::size_t wall_count = 0;
  Parameters<T>* own = nullptr;        // copy of the block's parameters, for effects to change
  Element<T>* meter = nullptr;         // of the first lane
  const Element<T>* motors = nullptr;  // rows of MotorRows, if energy is metered
  T* energy_J = nullptr;               // sum to which effects add extra_work_J()
  ContactBlock<Element<T>> contact;    // of the first lane
  const StepPlan* world = nullptr;
  Touched<T>* touched = nullptr;
  Sides<WingLoads<T>>* loads = nullptr;  // of every step, or null
  T rows[kEffectRows];                   // parameters, then SideConstants of both sides

  const Sides<SideConstants<T>>& constants() const {
    return *reinterpret_cast<const Sides<SideConstants<T>>*>(rows + kEffectParameterRows);
  }

  /// Lets every effect in force change the result of a stage: `stage(effect, parameters, state, change)`.
  template <class Change, class Stage, int I = 0>
  FLAPPY_INLINE void apply(Change& change, const Stage& stage, int state_row = 0) const {
    if constexpr (I < kEffects) {
      using Effect = EffectAt<I>;
      constexpr int kCount = static_cast<int>(Effect::kParameters.size());
      const auto& q = *reinterpret_cast<const T(*)[kCount]>(rows + effect_rows_before<I>());
      if constexpr (requires(const StateRows<T>& state) { stage(Effect{}, q, state, change); }) {
        if (__builtin_expect(set >> I & 1, 0)) {
          const StateRows<T> state{states + state_row * stride, stride, acts<Effect>(q)};
          Change changed = change;
          stage(Effect{}, q, state, changed);
          change = where(state.on, changed, change);
        }
      }
      apply<Change, Stage, I + 1>(change, stage, state_row + (kept >> I & 1 ? states_of<Effect>() : 0));
    }
  }

 private:
  /// Lanes in which at least one magnitude differs from 0.
  template <class Effect>
  static FLAPPY_INLINE auto acts(const T (&q)[Effect::kParameters.size()]) {
    auto none = q[0] == T(0);
    for (int i = 1; i < Effect::kInfo.magnitudes; ++i) none = none & (q[i] == T(0));
    return !none;
  }
};

template <class T>
FLAPPY_INLINE auto on_stop(const T& angle, const T& lower, const T& upper) {
  return (angle == lower) | (angle == upper);
}

/// Rates in the middle of the step, where angles already are. With u the rate of this step and u_before of the last,
/// the next is v = 2 u - u_before, limited by the stops; a hinge on its stop keeps its rate. Mean and mean square, (u +
/// v)/2 and (u^2 + v^2)/2, are second order. For a landing they are near the true values of its two steps, in which the
/// rate drops to 0, tau of a step after the angle was where it is: sums u (1/2 + tau), u^2 (1/2 + tau^2).
template <class T>
FLAPPY_INLINE HingeRates<T> mid_step_rates(const SideParameters<T>& p, const SideState<T>& q,
                                           const T& rotation_lower_rad, const T& rotation_upper_rad, const T& step,
                                           const T& per_step) {
  const auto next = [&](const T& rate, const T& before, const T& angle, const T& lower, const T& upper) {
    const T ahead = where(on_stop(angle, lower, upper), rate, T(T(2) * rate - before));
    return T(clamp(T(step * ahead), T(lower - angle), T(upper - angle)) * per_step);
  };
  const T &s = q.stroke_rate_rad_s, &r = q.rotation_rate_rad_s;
  const T s_next = next(s, q.stroke_rate_before_rad_s, q.stroke_rad, p.stroke_lower_rad, p.stroke_upper_rad);
  const T r_next = next(r, q.rotation_rate_before_rad_s, q.rotation_rad, rotation_lower_rad, rotation_upper_rad);
  return {T(0.5) * T(s + s_next), T(0.5) * T(r + r_next), T(0.5) * T(r * r + r_next * r_next)};
}

/// Loads of air and motor on one side. `air` includes M_rd at the mid-step rate of theta, `mid_rad_s`, which the body
/// feels; the hinge feels |old| new instead. Damping is implicit, as inertia on the hinge: step/2 damping, and step
/// M_rd/|theta'|.
template <int side, class T>
FLAPPY_INLINE SideLoad<T> load_side(const SideParameters<T>& p, const SideState<T>& q, const T& mid_rad_s,
                                    const WingWrench<T>& air, const T& voltage_V, const T& step) {
  SideLoad<T> load;
  load.force_x_N = air.force_x_N;
  load.force_z_N = air.force_z_N;
  load.moment_Nm = air.moment_Nm;
  load.stroke_torque_Nm = air.moment_Nm.z + T(side) * drive_torque(p, q, voltage_V);
  const T &old_rad_s = q.rotation_rate_rad_s, old_speed = abs(old_rad_s);
  const T damping_Nm = p.rotational_damping_Nm_s2 * T(T(abs(mid_rad_s) * mid_rad_s) - old_speed * old_rad_s);
  load.rotation_torque_Nm = (air.moment_Nm.y + damping_Nm) - p.rotation_damping_Nm_s * old_rad_s;
  load.rotation_stiffening_kg_m2 = step * T(T(0.5) * p.rotation_damping_Nm_s + p.rotational_damping_Nm_s2 * old_speed);
  return load;
}

/// Air on one wing. `velocity_B`: of its shoulder in the air, in B.
template <int side, class T>
FLAPPY_INLINE WingWrench<T> air_on_wing(const SideParameters<T>& p, const WingPose<T>& g, const Vec3<T>& velocity_B) {
  return blade_element<side>(p, g.theta, g.theta_rate, rotate_back_z(g.beta.sin, g.beta.cos, velocity_B),
                             {g.body_rate_L.x, g.body_rate_L.y, g.body_rate_L.z + g.beta_rate});
}

/// Turns the hinges of one side. The last clamp removes the rounding error of a landing on a stop.
template <int side, class T>
FLAPPY_INLINE void turn(const SideParameters<T>& p, SideState<T>& q, const T& beta, const T& theta, const T& per_step) {
  const T stroke_rate = T(side) * T(beta * per_step), rotation_rate = theta * per_step;
  q.stroke_rate_before_rad_s =
      where(on_stop(q.stroke_rad, p.stroke_lower_rad, p.stroke_upper_rad), stroke_rate, q.stroke_rate_rad_s);
  q.rotation_rate_before_rad_s =
      where(on_stop(q.rotation_rad, p.rotation_lower_rad, p.rotation_upper_rad), rotation_rate, q.rotation_rate_rad_s);
  q.stroke_rate_rad_s = stroke_rate;
  q.rotation_rate_rad_s = rotation_rate;
  q.stroke_rad = clamp(T(q.stroke_rad + T(T(side) * beta)), p.stroke_lower_rad, p.stroke_upper_rad);
  q.rotation_rad = clamp(T(q.rotation_rad + theta), p.rotation_lower_rad, p.rotation_upper_rad);
}

template <class T>
FLAPPY_INLINE void find_wall(const ActiveEffects<T>& effects, Surroundings<T>& s) {
  s.wall_clearance_m = T(1e6);
  s.wall_normal_x = T(1);
  s.wall_normal_y = T(0);
  for (const Wall* w = effects.walls; w != effects.walls + effects.wall_count; ++w) {
    const T x(w->normal_x), y(w->normal_y);
    const T clearance = x * T(s.position_m.x - T(w->x_m)) + y * T(s.position_m.y - T(w->y_m));
    const auto nearer = clearance < s.wall_clearance_m;
    s.wall_clearance_m = where(nearer, clearance, s.wall_clearance_m);
    s.wall_normal_x = where(nearer, x, s.wall_normal_x);
    s.wall_normal_y = where(nearer, y, s.wall_normal_y);
  }
}

template <class T>
FLAPPY_INLINE Hinges<T> hinges_of(const SideParameters<T>& p, const SideConstants<T>& constants, const SideState<T>& x,
                                  const T& voltage_V) {
  const T none(-0.0);
  return {T(1),
          voltage_V,
          x.stroke_rate_rad_s,
          constants.resistance_ohm,
          p.stroke_torque_per_V_Nm,
          p.stroke_damping_Nm_s,
          p.stroke_stiffening_kg_m2,
          p.stroke_friction_Nm,
          p.rotor_kg_m2,
          p.spring_positive_Nm_rad,
          p.spring_negative_Nm_rad,
          p.rotation_lower_rad,
          p.rotation_upper_rad,
          none,
          none,
          none,
          none};
}

/// Replaces the parameters of a side by its hinges after effects changed them.
template <class T>
FLAPPY_INLINE void put_hinges(const Hinges<T>& h, SideParameters<T>& p) {
  p.stroke_torque_per_V_Nm = h.torque_per_V_Nm;
  p.stroke_damping_Nm_s = h.damping_Nm_s;
  p.stroke_stiffening_kg_m2 = h.stiffening_kg_m2;
  p.stroke_friction_Nm = h.friction_Nm;
  p.rotor_kg_m2 = h.rotor_kg_m2;
  p.spring_positive_Nm_rad = h.spring_positive_Nm_rad;
  p.spring_negative_Nm_rad = h.spring_negative_Nm_rad;
  p.rotation_lower_rad = h.rotation_lower_rad;
  p.rotation_upper_rad = h.rotation_upper_rad;
}

template <bool with_effects, class T>
struct Acting {
  const Parameters<T>& p;
  const Voltages<T>& voltages;
  Sides<WingWrench<T>> air;
  BodyLoad<T> body;
};

/// Loads on a flapper with effects, which change a copy of its parameters and voltages.
template <class T>
struct Acting<true, T> {
  Surroundings<T> s;
  Sides<Hinges<T>> hinges;
  Parameters<T>& p;
  Voltages<T> voltages;
  Sides<WingWrench<T>> air;
  BodyLoad<T> body;
};

/// Writes the source's share of its nominal voltage and the currents of both motors.
template <class T>
FLAPPY_INLINE void read_meter(const Surroundings<T>& s, const Sides<Hinges<T>>& hinges, Element<T>* meter, int stride) {
  const auto current = [](const Hinges<T>& h, const SideConstants<T>& f) {
    return T(T(h.voltage_V - f.back_emf_V_s * h.motor_rate_rad_s) / h.resistance_ohm);
  };
  hinges.left.source_share.store(meter);
  current(hinges.left, s.constants.left).store(meter + stride);
  current(hinges.right, s.constants.right).store(meter + 2 * stride);
}

/// Loads of one side. `velocity_B`: of its shoulder in the air, in B.
template <int side, class T>
FLAPPY_INLINE WingLoads<T> read_loads(const SideParameters<T>& p, const SideState<T>& q, const SideConstants<T>& f,
                                      const Hinges<T>& h, const WingPose<T>& g, const WingWrench<T>& air,
                                      const Vec3<T>& velocity_B) {
  const Vec3<T> force = rotate_z(g.beta.sin, g.beta.cos, air.force_x_N, air.force_z_N);
  const Vec3<T> moment = rotate_z(g.beta.sin, g.beta.cos, air.moment_Nm) + cross(p.shoulder_m, force);
  const Vec3<T> v = rotate_back_z(g.beta.sin, g.beta.cos, velocity_B);
  const Vec3<T> w{g.body_rate_L.x, g.body_rate_L.y, g.body_rate_L.z + g.beta_rate};
  const T r = T(side) * p.span_to_pressure_m;
  const T along_x = v.x - T(w.z * r), along_z = v.z + T(w.x * r);  // velocity of the axis at r_cp
  const T inverse_speed = T(1) / sqrt(T(along_x * along_x + (along_z * along_z + T(kStillAir_m2_s2))));
  const T across = T(air.force_z_N * along_x - air.force_x_N * along_z) * inverse_speed;
  const T turning = air.moment_Nm.x * w.x + (air.moment_Nm.y * T(w.y + g.theta_rate) + air.moment_Nm.z * w.z);
  const T motor_rad_s = T(side) * g.beta_rate + T(h.motor_rate_rad_s - q.stroke_rate_rad_s);
  return {force,
          moment,
          where(along_x < T(0), T(-across), across),
          -T(T(air.force_x_N * along_x + air.force_z_N * along_z) * inverse_speed),
          -T(turning + (air.force_x_N * v.x + air.force_z_N * v.z)),
          T(h.torque_per_V_Nm * T(h.voltage_V - f.back_emf_V_s * motor_rad_s)) * motor_rad_s};
}

/// Energy of a motor in a step in excess of that at `given_V` without effects: V i h, at the rate at the end of the
/// step, which turns the wing; exactly 0 if no effect changes the motor. `slip_rad_s`: motor relative to wing.
template <int side, class T>
FLAPPY_INLINE T extra_work_J(const ActiveEffects<T>& effects, const Hinges<T>& h, const T& given_V, const T& rate_rad_s,
                             const T& slip_rad_s, const T& step_s) {
  const Element<T>* rows = effects.motors + (side > 0 ? 0 : 2) * effects.stride;
  const T conductance_S = T::load(rows), emf_current_A_s = T::load(rows + effects.stride);
  const auto power_W = [&](const T& volt, const T& rate) {
    return T(volt * T(conductance_S * volt - emf_current_A_s * rate));
  };
  const T& cold_ohm = of_side<side>(effects.constants()).resistance_ohm;
  const T share = where(h.resistance_ohm == cold_ohm, T(1), T(cold_ohm / h.resistance_ohm));
  return step_s * T(share * power_W(h.voltage_V, T(rate_rad_s + slip_rad_s)) - power_W(given_V, rate_rad_s));
}

/// Rotation angle up to which effects let a wing turn, in both directions; 0: its own stops.
template <class T>
FLAPPY_INLINE T reach_beyond_stops(const ActiveEffects<T>& effects) {
  T reach_rad(0);
  effects.apply(
      reach_rad, [](auto effect, const auto&, const auto&, auto& reach) requires requires { effect.kReach_rad; } {
        reach = T(effect.kReach_rad);
      });
  return reach_rad;
}

template <class T>
FLAPPY_INLINE void widen_stops(const T& reach_rad, T& lower_rad, T& upper_rad) {
  lower_rad = where(reach_rad > T(0), T(-reach_rad), lower_rad);
  upper_rad = where(reach_rad > T(0), reach_rad, upper_rad);
}

template <class T>
FLAPPY_INLINE void apply_effects(const ActiveEffects<T>& effects, Acting<true, T>& a) {
  Surroundings<T>& s = a.s;
  find_wall(effects, s);
  effects.apply(
      a.hinges, [&](auto effect, const auto& q, const auto& state,
                    auto& change) requires requires { effect.motor(q, s, state, change); } {
        effect.motor(q, s, state, change);
      });
  effects.apply(
      a.hinges, [&](auto effect, const auto& q, const auto& state,
                    auto& change) requires requires { effect.hinges(q, s, state, change); } {
        effect.hinges(q, s, state, change);
      });
  if (effects.meter != nullptr) read_meter(s, a.hinges, effects.meter, effects.stride);
  put_hinges(a.hinges.left, a.p.left);
  put_hinges(a.hinges.right, a.p.right);
  a.voltages = {a.hinges.left.voltage_V, a.hinges.right.voltage_V};
  effects.apply(
      s.wind_B_m_s, [&](auto effect, const auto& q, const auto& state,
                        auto& change) requires requires { effect.wind(q, s, state, change); } {
        effect.wind(q, s, state, change);
      });
  s.shoulder_B_m_s = {s.shoulder_B_m_s.left - s.wind_B_m_s, s.shoulder_B_m_s.right - s.wind_B_m_s};
  a.air = {air_on_wing<+1>(s.p.left, s.pose.left, s.shoulder_B_m_s.left),
           air_on_wing<-1>(s.p.right, s.pose.right, s.shoulder_B_m_s.right)};
  effects.apply(
      a.air.left, [&](auto effect, const auto& q, const auto& state,
                      auto& change) requires requires { effect.template air<+1>(q, s, state, change); } {
        effect.template air<+1>(q, s, state, change);
      });
  effects.apply(
      a.air.right, [&](auto effect, const auto& q, const auto& state,
                       auto& change) requires requires { effect.template air<-1>(q, s, state, change); } {
        effect.template air<-1>(q, s, state, change);
      });
  s.lift_N = a.air.left.force_z_N + a.air.right.force_z_N;
  effects.apply(
      a.body, [&](auto effect, const auto& q, const auto& state,
                  auto& change) requires requires { effect.world(q, s, state, change); } {
        effect.world(q, s, state, change);
      });
}

template <class T>
FLAPPY_INLINE void add_hinges(const Hinges<T>& h, SideLoad<T>& load, WingInertia<T>& wing) {
  load.stroke_torque_Nm += h.stroke_torque_Nm;
  load.rotation_torque_Nm += h.rotation_torque_Nm;
  load.rotation_stiffening_kg_m2 += h.rotation_inertia_kg_m2;
  wing.cross_inertia += h.cross_inertia_kg_m2;
}

template <class T>
FLAPPY_INLINE void remember(const ActiveEffects<T>& effects, Acting<true, T>& a) {
  effects.apply(
      a.hinges, [&](auto effect, const auto& q, const auto& state,
                    const auto& hinges) requires requires { effect.after(q, a.s, state, hinges); } {
        effect.after(q, a.s, state, hinges);
      });
}

/// Computes the centre of mass of a held body and its velocity from the fixed torso, and releases a standing body once
/// its wings carry it. True for lanes that are still held.
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

template <class T>
FLAPPY_INLINE void feel(const Parameters<T>& p, State<T>& x, const Sides<WingPose<T>>& pose,
                        const Sides<WingWrench<T>>& air, const T& lift, const T& step, typename T::Mask held) {
  if (!rarely(held)) return;
  const auto force = [](const WingPose<T>& g, const WingWrench<T>& a) {
    return rotate_z(g.beta.sin, g.beta.cos, a.force_x_N, a.force_z_N);
  };
  const auto moment = [](const WingPose<T>& g, const WingWrench<T>& a) {
    return rotate_z(g.beta.sin, g.beta.cos, a.moment_Nm);
  };
  const Vec3<T> force_l = force(pose.left, air.left), force_r = force(pose.right, air.right);
  const Vec3<T> about_origin = (moment(pose.left, air.left) + moment(pose.right, air.right)) +
                               (cross(p.left.shoulder_m, force_l) + cross(p.right.shoulder_m, force_r));
  x.impulse_N_s = where(held, add_scaled(x.impulse_N_s, step, force_l + force_r), x.impulse_N_s);
  x.angular_impulse_Nm_s = where(held, add_scaled(x.angular_impulse_Nm_s, step, about_origin), x.angular_impulse_Nm_s);
  x.lift_N = where(held, T(x.lift_N + T(lift - x.lift_N) / p.beat_steps), x.lift_N);
}

/// Loads on a flapper: air and motors, or with effects the values with which they begin.
template <bool with_effects, class T>
FLAPPY_INLINE Acting<with_effects, T> acts_on(const Parameters<T>& p, const State<T>& x, const Voltages<T>& voltages,
                                              const Matrix3<T>& R, const Sides<WingPose<T>>& pose,
                                              const WholeVehicle<T>& whole, const Vec3<T>& com_m,
                                              const ActiveEffects<T>& effects, const Constants<T>& k) {
  const T zero(0);
  const Vec3<T>&w = x.body_rate_rad_s, v_C = transpose_times(R, x.com_velocity_m_s) - whole.com_rate;
  const Vec3<T> v_left = v_C + cross(w, whole.arm_left), v_right = v_C + cross(w, whole.arm_right);
  const BodyLoad<T> none{{zero, zero, zero}, {zero, zero, zero}};
  if constexpr (with_effects) {
    const T stroke_plane = T(0.5) * T(p.left.shoulder_m.z + p.right.shoulder_m.z);
    const Sides<SideConstants<T>>& constants = effects.constants();
    return {{p,
             x,
             pose,
             constants,
             R,
             com_m - R * whole.com,
             v_C - cross(w, whole.com),
             whole.com,
             stroke_plane,
             k.step,
             k.per_step,
             k.gravity,
             k.ground_z,
             k.ceiling_z,
             zero,
             zero,
             zero,
             {zero, zero, zero},
             {v_left, v_right},
             zero},
            {hinges_of(p.left, constants.left, x.left, voltages.left_V),
             hinges_of(p.right, constants.right, x.right, voltages.right_V)},
            *effects.own,
            voltages,
            {},
            none};
  } else {
    return {
        p, voltages, {air_on_wing<+1>(p.left, pose.left, v_left), air_on_wing<-1>(p.right, pose.right, v_right)}, none};
  }
}

/// Rows have positions and rates at the same time, but within a block positions lead by half a step: rates advance
/// across its middle, positions with the new rates to the next middle (Verlet 1967, as leapfrog). Backward, a hinge on
/// its stop stays there, so both shifts are exact inverses.
template <bool with_effects, class L>
FLAPPY_INLINE void shift_positions(const Parameters<L>& p, const L& reach_rad, const L& time_s, State<L>& x,
                                   Vec3<L>& com_m) {
  const auto shift = [&](const SideParameters<L>& side, SideState<L>& q) {
    L lower_rad = side.rotation_lower_rad, upper_rad = side.rotation_upper_rad;
    if constexpr (with_effects) widen_stops(reach_rad, lower_rad, upper_rad);
    const auto shifted = [&](const L& angle, const L& rate, const L& lower, const L& upper) {
      const auto stays = (time_s < L(0)) & on_stop(angle, lower, upper);
      return where(stays, angle, clamp(L(angle + time_s * rate), lower, upper));
    };
    q.stroke_rad = shifted(q.stroke_rad, q.stroke_rate_rad_s, side.stroke_lower_rad, side.stroke_upper_rad);
    q.rotation_rad = shifted(q.rotation_rad, q.rotation_rate_rad_s, lower_rad, upper_rad);
  };
  shift(p.left, x.left);
  shift(p.right, x.right);
  com_m = add_scaled(com_m, time_s, x.com_velocity_m_s);
  x.attitude = rotated(x.attitude, L(0.5) * time_s * x.body_rate_rad_s);
}

/// Puts what is in force in a block before the lanes from `first` on. `own`: a copy of their parameters, and `touched`; both
/// stay with `effects`.
template <class T, class L>
FLAPPY_INLINE void activate(const BlockEffects<T>& in_force, const StepPlan& plan, int first, Parameters<L>& own,
                            Touched<L>& touched, ActiveEffects<L>& effects) {
  effects.own = &own;
  effects.set = in_force.set;
  effects.kept = in_force.kept;
  effects.states = in_force.states != nullptr ? in_force.states + first : nullptr;
  effects.stride = kLanes<T>;
  effects.meter = in_force.meter != nullptr ? in_force.meter + first : nullptr;
  effects.walls = plan.walls;
  effects.wall_count = plan.wall_count;
  effects.contact = in_force.contact;
  if (effects.contact.points > 0) {
    effects.contact.rows += first;
    effects.contact.memory += first;
  }
  effects.world = &plan;
  effects.touched = &touched;
  for (int i = 0; i < kEffectRows; ++i) effects.rows[i] = L::load(in_force.rows + i * kLanes<T> + first);
}

/// One physics step. `com_m`: centre of mass in W, integrated instead of the torso's origin as momentum belongs to it.
template <bool with_effects, class T>
FLAPPY_INLINE void physics_step(const Parameters<T>& vehicle, State<T>& x, const Voltages<T>& voltages, Vec3<T>& com_m,
                                const ActiveEffects<T>& effects, const Constants<T>& k) {
  const Matrix3<T> R = rotation_matrix(x.attitude);
  const Vec3<T>& w = x.body_rate_rad_s;
  const auto mid_rates = [&](const SideParameters<T>& p, const SideState<T>& q) {
    T lower = p.rotation_lower_rad, upper = p.rotation_upper_rad;
    if constexpr (with_effects) widen_stops(reach_beyond_stops(effects), lower, upper);
    return mid_step_rates(p, q, lower, upper, k.step, k.per_step);
  };
  const Sides<WingPose<T>> pose{place_wing<+1>(vehicle.left, x.left, mid_rates(vehicle.left, x.left), w),
                                place_wing<-1>(vehicle.right, x.right, mid_rates(vehicle.right, x.right), w)};
  const WholeVehicle<T> whole = whole_vehicle(vehicle, pose);
  const auto held = hold(vehicle, x, whole, R, com_m, k.gravity);

  auto acting = acts_on<with_effects>(vehicle, x, voltages, R, pose, whole, com_m, effects, k);
  if constexpr (with_effects) apply_effects(effects, acting);
  if constexpr (with_effects)
    if (effects.loads != nullptr) {
      const Surroundings<T>& s = acting.s;
      const Sides<Hinges<T>>& hinges = acting.hinges;
      *effects.loads = {read_loads<+1>(acting.p.left, x.left, s.constants.left, hinges.left, pose.left, acting.air.left,
                                       s.shoulder_B_m_s.left),
                        read_loads<-1>(acting.p.right, x.right, s.constants.right, hinges.right, pose.right,
                                       acting.air.right, s.shoulder_B_m_s.right)};
    }
  const Parameters<T>& p = acting.p;
  Sides<SideLoad<T>> load{
      load_side<+1>(p.left, x.left, pose.left.theta_rate, acting.air.left, acting.voltages.left_V, k.step),
      load_side<-1>(p.right, x.right, pose.right.theta_rate, acting.air.right, acting.voltages.right_V, k.step)};
  Sides<WingInertia<T>> wing{wing_inertia(p.left, pose.left), wing_inertia(p.right, pose.right)};
  if constexpr (with_effects) {
    add_hinges(acting.hinges.left, load.left, wing.left);
    add_hinges(acting.hinges.right, load.right, wing.right);
  }

  T slip_left(0), slip_right(0);
  if constexpr (with_effects) {
    if (effects.contact.points > 0) {
      const Surroundings<T>& s = acting.s;
      touch(*effects.world, effects.contact,
            TouchingVehicle<T>{vehicle, pose, R, s.position_m, s.velocity_B_m_s, w, s.com_m}, held, k.step, acting.body,
            load, *effects.touched);
    }
    slip_left = acting.hinges.left.motor_rate_rad_s - x.left.stroke_rate_rad_s;
    slip_right = acting.hinges.right.motor_rate_rad_s - x.right.stroke_rate_rad_s;
  }

  const BodyInertia<T> inertia = body_inertia(p, x, pose, wing, whole);
  const BodyDrive<T> body_drive = drive_body(p, x, pose, wing, whole, inertia, load, acting.body, R.row_z, k.gravity);
  const HingeSystem<T> hinges = eliminate_body(p, pose, wing, whole, inertia, body_drive, load);
  const Motion<T> m = move(p, x, inertia, body_drive, hinges, k.step, k.per_step);
  const Vec3<T> force = R * body_drive.force;
  x.body_rate_rad_s = add_scaled(w, k.step, m.body_acceleration);
  x.com_velocity_m_s = add_scaled(x.com_velocity_m_s, T(k.step * p.inverse_mass_1_kg), force);
  x.com_velocity_m_s.z -= k.step * k.gravity;

  turn<+1>(p.left, x.left, m.stroke_left, m.rotation_left, k.per_step);
  turn<-1>(p.right, x.right, m.stroke_right, m.rotation_right, k.per_step);
  com_m = add_scaled(com_m, k.step, x.com_velocity_m_s);
  x.attitude = rotated(x.attitude, k.half_step * x.body_rate_rad_s);
  feel(p, x, pose, acting.air, force.z, k.step, held);
  if constexpr (with_effects) {
    if (effects.motors != nullptr)
      *effects.energy_J +=
          extra_work_J<+1>(effects, acting.hinges.left, voltages.left_V, x.left.stroke_rate_rad_s, slip_left, k.step) +
          extra_work_J<-1>(effects, acting.hinges.right, voltages.right_V, x.right.stroke_rate_rad_s, slip_right,
                           k.step);
    remember(effects, acting);
  }
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
