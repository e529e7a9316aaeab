// The step of beat-averaged robots: a rigid body under the force and moment of the vehicle's expressions and effects.
//   m v' = R F + m g   I w' = M - w x I w   q' = q w / 2   about the centre of mass
// Positions drift for half a step; then rates change by the loads in the middle, which depend on them (midpoint rule);
// then positions drift on with the new rates: of second order. Compiled once per instruction set (FLAPPY_ISA), with the
// same bits.
#include <limits>
#include <utility>

#include "sim/end_of_steps.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {
namespace {

template <class L>
struct Body {
  Vec3<L> com_m, velocity_m_s;  // of the centre of mass, in W
  Quaternion<L> attitude;
  Vec3<L> rate_rad_s;
};

template <class L>
struct Acceleration {
  Vec3<L> linear_m_s2, angular_rad_s2;  // in W, in B
  BeatAveragedLoads<L> load;            // without gravity
};

template <class T>
class BeatAveragedLanes {
  using L = Lanes<T, kWidth<T>>;

 public:
  BeatAveragedLanes(const BeatAveragedRows<T>& beat_averaged, const Block<T>& block, const StepPlan& plan, int first)
      : rows_of_(beat_averaged),
        plan_(plan),
        first_(first),
        body_(load_rows<BeatAveragedBody<L>>(rows(beat_averaged.body_row), first)),
        parameters_(view_rows<Parameters<L>>(block.parameters, first)) {
    weight_ = {memory(1), memory(2), memory(3), memory(4)};
    for (std::size_t k = 0; k < rows_of_.actuator_count; ++k) end_[k] = memory(kActuatorRow + k);
  }

  const BeatAveragedBody<L>& body() const { return body_; }

  void set_inputs(const WingBeat<L>& says) {
    const L four[] = {says.amplitude_V, says.difference_V, says.bias_V, says.split_cycle};
    for (std::size_t k = 0; k < rows_of_.inputs; ++k) {
      const auto input = load_rows<BeatAveragedInput<L>>(rows(k * model::kRows<BeatAveragedInput>), first_);
      L sum = input.neutral;
      for (int i = 0; i < 4; ++i) sum += input.mix[i] * four[i];
      input_[k] = clamp(sum, input.low, input.high);
    }
    start_fresh();
  }

  /// Lets the actuators follow their inputs for a step; loads use their values in the middle of the step.
  void drive(std::int64_t step) {
    L late[kMaxInputs];
    for (std::size_t k = 0; k < rows_of_.inputs; ++k) late[k] = input_[k];
    if (rows_of_.slots > 0) remember(static_cast<std::size_t>(step) % rows_of_.slots, late);
    const L per_step(1 / plan_.step_s);
    stroke_plane_ = stroke_plane_1_s_ = beat_share_ = L(0);
    int flapping = 0;
    for (std::size_t k = 0; k < rows_of_.actuator_count; ++k) {
      const DrivenActuator& a = rows_of_.actuators[k];
      const auto constants = actuator(k);
      const L wanted = constants.gain * late[a.input] + constants.offset, before = end_[k];
      value_[k] = wanted + constants.kept * L(before - wanted);
      end_[k] = wanted + constants.kept * L(value_[k] - wanted);
      if (a.role == BeatAveraged::Role::stroke_plane) {
        stroke_plane_ += value_[k];
        stroke_plane_1_s_ += per_step * L(end_[k] - before);
      } else if (a.role == BeatAveraged::Role::flapping) {
        beat_share_ += value_[k];
        ++flapping;
      }
    }
    if (flapping > 0) beat_share_ = L(1 / (flapping * rows_of_.nominal_Hz)) * beat_share_;
  }

  /// For a robot that has not flown: a weight on a line hangs at rest.
  void hang(const Body<L>& x) {
    const auto fresh = memory(0) == L(0);
    if (!any(fresh)) return;
    const BeatAveragedState<L> s = state_of(x);
    for_effects([&]<class Effect>(const auto& q) {
      if constexpr (requires { Effect::beat_averaged_hang(q, s, weight_); }) {
        Hanging<L> rest = weight_;
        Effect::beat_averaged_hang(q, s, rest);
        weight_ = {where(fresh, rest.x_m, weight_.x_m), where(fresh, rest.y_m, weight_.y_m),
                   where(fresh, rest.velocity_x_m_s, weight_.velocity_x_m_s),
                   where(fresh, rest.velocity_y_m_s, weight_.velocity_y_m_s),
                   where(fresh, rest.tension_m_s2, weight_.tension_m_s2)};
      }
    });
  }

  /// `held`: what holds a robot takes all that pulls at it.
  void swing(const Body<L>& x, const Acceleration<L>& a, typename L::Mask held) {
    for_effects([&]<class Effect>(const auto& q) {
      if constexpr (requires { Effect::beat_averaged_hang(q, state_of(x), weight_); }) {
        BeatAveragedState<L> s = state_of(x);
        const Vec3<L> free = parameters_.inverse_mass_1_kg * a.load.force_N;
        const Vec3<L> rests = transpose_times(s.attitude, Vec3<L>{L(0), L(0), s.gravity_m_s2});
        s.force_m_s2 = {where(held, rests.x, free.x), where(held, rests.y, free.y), where(held, rests.z, free.z)};
        s.mass_kg = where(held, L(std::numeric_limits<double>::infinity()), s.mass_kg);
        Effect::beat_averaged_swing(q, s, L(plan_.step_s), weight_);
      }
    });
  }

  Acceleration<L> accelerate(const Body<L>& x) const {
    BeatAveragedState<L> s = state_of(x);
    const Matrix3<L>& R = s.attitude;
    for_effects([&]<class Effect>(const auto& q) {
      if constexpr (requires { Effect::beat_averaged_wind(q, s, s.wind_B_m_s); })
        Effect::beat_averaged_wind(q, s, s.wind_B_m_s);
    });
    BeatAveragedLoads<L> load = own_load(s);
    s.thrust_N = load.force_N.z;
    load.moment_Nm = load.moment_Nm - cross(body_.com_m, load.force_N);  // about the centre of mass
    for_effects([&]<class Effect>(const auto& q) {
      if constexpr (requires { Effect::beat_averaged_load(q, s, load); }) Effect::beat_averaged_load(q, s, load);
    });
    Acceleration<L> a;
    a.load = load;
    a.linear_m_s2 = parameters_.inverse_mass_1_kg * (R * load.force_N);
    a.linear_m_s2.z -= L(plan_.gravity_m_s2);
    a.angular_rad_s2 =
        body_.inverse_inertia * (load.moment_Nm - cross(s.rate_rad_s, body_.inertia_kg_m2 * s.rate_rad_s));
    return a;
  }

  void store(typename L::Mask moves) const {
    where(moves, L(1), memory(0)).store(memory_at(0));
    const L weight[] = {weight_.x_m, weight_.y_m, weight_.velocity_x_m_s, weight_.velocity_y_m_s, weight_.tension_m_s2};
    for (std::size_t k = 0; k < kHanging; ++k) where(moves, weight[k], memory(1 + k)).store(memory_at(1 + k));
    for (std::size_t k = 0; k < rows_of_.actuator_count; ++k)
      where(moves, end_[k], memory(kActuatorRow + k)).store(memory_at(kActuatorRow + k));
  }

 private:
  static constexpr std::size_t kActuatorRow = 1 + kHanging;

  BeatAveragedState<L> state_of(const Body<L>& x) const {
    const L zero(0);
    const Matrix3<L> R = rotation_matrix(x.attitude);
    return {R,
            x.com_m - R * body_.com_m,
            transpose_times(R, x.velocity_m_s) - cross(x.rate_rad_s, body_.com_m),
            x.rate_rad_s,
            {zero, zero, zero},
            body_.com_m,
            body_.mass_kg,
            L(plan_.gravity_m_s2),
            parameters_.air_density_kg_m3,
            L(plan_.ground_z_m),
            beat_share_,
            stroke_plane_,
            stroke_plane_1_s_,
            {zero, zero, zero},
            zero,
            weight_,
            {zero, zero, zero}};
  }

  const T (*rows(std::size_t row) const)[kLanes<T>] {
    return reinterpret_cast<const T(*)[kLanes<T>]>(rows_of_.rows) + row;
  }
  T* memory_at(std::size_t row) const { return rows_of_.memory + row * kLanes<T> + first_; }
  L memory(std::size_t row) const { return L::load(memory_at(row)); }
  BeatAveragedActuator<L> actuator(std::size_t k) const {
    return load_rows<BeatAveragedActuator<L>>(rows(rows_of_.actuator_row + k * model::kRows<BeatAveragedActuator>),
                                              first_);
  }

  /// For a robot that has not flown: actuators and past inputs as if its first inputs had been held for long.
  void start_fresh() {
    const auto fresh = memory(0) == L(0);
    if (!any(fresh)) return;
    for (std::size_t k = 0; k < rows_of_.actuator_count; ++k) {
      const auto constants = actuator(k);
      end_[k] = where(fresh, L(constants.gain * input_[rows_of_.actuators[k].input] + constants.offset), end_[k]);
    }
    for (std::size_t slot = 0; slot < rows_of_.slots; ++slot)
      for (std::size_t k = 0; k < rows_of_.inputs; ++k)
        where(fresh, input_[k], memory(row_of(slot, k))).store(memory_at(row_of(slot, k)));
  }

  std::size_t row_of(std::size_t slot, std::size_t input) const {
    return kActuatorRow + rows_of_.actuator_count + slot * rows_of_.inputs + input;
  }

  /// Stores the inputs of a step, and replaces them by the inputs that arrive now, after the delay.
  void remember(std::size_t now, L (&inputs)[kMaxInputs]) const {
    for (std::size_t k = 0; k < rows_of_.inputs; ++k) {
      inputs[k].store(memory_at(row_of(now, k)));
      for (int i = 0; i < kWidth<T>; ++i) {
        const auto whole = static_cast<std::size_t>(body_.late_steps.raw[i]);
        const T part = body_.late_steps.raw[i] - static_cast<T>(whole);
        const T newer = memory_at(row_of((now + rows_of_.slots - whole) % rows_of_.slots, k))[i],
                older = memory_at(row_of((now + rows_of_.slots - whole - 1) % rows_of_.slots, k))[i];
        inputs[k].raw[i] = (1 - part) * newer + part * older;
      }
    }
  }

  BeatAveragedLoads<L> own_load(const BeatAveragedState<L>& s) const {
    const Vec3<L> air = s.velocity_B_m_s - s.wind_B_m_s;
    const std::size_t n = rows_of_.actuator_count;
    L variables[kMaxActuators + kMotionVariables];
    for (std::size_t k = 0; k < n; ++k) variables[k] = value_[k];
    L* const motion = variables + n;
    motion[kVx] = air.x, motion[kVy] = air.y, motion[kVz] = air.z;
    motion[kSpeed] = sqrt(L(dot(air, air)));
    motion[kWx] = s.rate_rad_s.x, motion[kWy] = s.rate_rad_s.y, motion[kWz] = s.rate_rad_s.z;
    motion[kBatteryShare] = L(1);  // the simulated battery stays full
    L sum[6] = {L(0), L(0), L(0), L(0), L(0), L(0)};
    for (std::size_t k = 0; k < rows_of_.product_count; ++k) {
      const BeatAveragedProduct& p = rows_of_.products[k];
      L value = L::load(rows(rows_of_.product_row + k)[0] + first_);
      for (std::size_t i = p.first; i < p.last; ++i) value = value * variables[rows_of_.variables[i]];
      sum[p.component] += value;
    }
    return {{sum[0], sum[1], sum[2]}, {sum[3], sum[4], sum[5]}};
  }

  /// Calls use<Effect>(its parameters) for each effect that any robot has.
  template <int I = 0>
  FLAPPY_INLINE void for_effects(const auto& use) const {
    if constexpr (I < kBeatAveragedEffects) {
      if (rows_of_.effects >> I & 1) {
        constexpr int kCount = static_cast<int>(beat_averaged_parameters<BeatAveragedEffectAt<I>>().size());
        L q[kCount];
        for (int k = 0; k < kCount; ++k)
          q[k] = L::load(rows(rows_of_.effect_row + static_cast<std::size_t>(beat_averaged_rows_before<I>() + k))[0] +
                         first_);
        use.template operator()<BeatAveragedEffectAt<I>>(q);
      }
      for_effects<I + 1>(use);
    }
  }

  const BeatAveragedRows<T>& rows_of_;
  const StepPlan& plan_;
  int first_;
  const BeatAveragedBody<L> body_;
  const Parameters<L> parameters_;
  L input_[kMaxInputs], value_[kMaxActuators], end_[kMaxActuators];  // in mid-step; at the end of the step
  L stroke_plane_{0.0}, stroke_plane_1_s_{0.0}, beat_share_{0.0};
  Hanging<L> weight_;
};

template <class L>
FLAPPY_INLINE void drift(Body<L>& x, const L& time_s) {
  x.com_m = add_scaled(x.com_m, time_s, x.velocity_m_s);
  x.attitude = rotated(x.attitude, L(L(0.5) * time_s) * x.rate_rad_s);
}

/// Adds to support impulse and averaged lift of a held body; releases a standing body once that lift carries it.
template <class L>
FLAPPY_INLINE void feel(const Parameters<L>& p, const BeatAveragedBody<L>& body, const BeatAveragedLoads<L>& load,
                        const L& lift_N, const StepPlan& plan, State<L>& x) {
  const auto held = x.support > L(0);
  if (!rarely(held)) return;
  const L step(plan.step_s);
  x.impulse_N_s = where(held, add_scaled(x.impulse_N_s, step, load.force_N), x.impulse_N_s);
  x.angular_impulse_Nm_s =
      where(held, add_scaled(x.angular_impulse_Nm_s, step, load.moment_Nm + cross(body.com_m, load.force_N)),
            x.angular_impulse_Nm_s);
  x.lift_N = where(held, L(x.lift_N + L(lift_N - x.lift_N) / p.beat_steps), x.lift_N);
  const auto carried = (x.support == L(1)) & (x.lift_N * p.inverse_mass_1_kg > L(plan.gravity_m_s2));
  x.support = where(carried, L(-1), x.support);
}

template <class T>
void step_mean_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t first_step,
                     int steps, const Ahead&) {
  using L = Lanes<T, kWidth<T>>;
  const L step(plan.step_s), half(plan.step_s / 2);
  for (int first = 0; first < kLanes<T>; first += kWidth<T>) {
    const auto& p = view_rows<Parameters<L>>(block.parameters, first);
    auto x = load_rows<State<L>>(block.state, first);
    BeatAveragedLanes<T> lanes(in_force.beat_averaged, block, plan, first);
    lanes.set_inputs(load_rows<Drive<L>>(block.drive, first).input);
    const Vec3<L> from_origin_m = lanes.body().com_m;
    Body<L> body{x.position_m + rotation_matrix(x.attitude) * from_origin_m, x.com_velocity_m_s, x.attitude,
                 x.body_rate_rad_s};
    lanes.hang(body);
    for (int i = 0; i < steps; ++i) {
      lanes.drive(first_step + i);
      const Body<L> before = body;
      drift(body, half);
      Body<L> middle = body;
      const Acceleration<L> now = lanes.accelerate(middle);
      middle.velocity_m_s = add_scaled(body.velocity_m_s, half, now.linear_m_s2);
      middle.rate_rad_s = add_scaled(body.rate_rad_s, half, now.angular_rad_s2);
      const Acceleration<L> a = lanes.accelerate(middle);
      const auto held = x.support > L(0);
      lanes.swing(middle, a, held);
      body.velocity_m_s = add_scaled(body.velocity_m_s, step, a.linear_m_s2);
      body.rate_rad_s = add_scaled(body.rate_rad_s, step, a.angular_rad_s2);
      drift(body, half);
      if (!rarely(held)) continue;
      const Vec3<L> none{L(0), L(0), L(0)};
      body.com_m = where(held, before.com_m, body.com_m);
      body.attitude = {where(held, before.attitude.w, body.attitude.w), where(held, before.attitude.x, body.attitude.x),
                       where(held, before.attitude.y, body.attitude.y),
                       where(held, before.attitude.z, body.attitude.z)};
      body.velocity_m_s = where(held, none, body.velocity_m_s);
      body.rate_rad_s = where(held, none, body.rate_rad_s);
      const L lift_N = (rotation_matrix(before.attitude) * now.load.force_N).z;
      feel(p, lanes.body(), now.load, lift_N, plan, x);
    }
    x.com_velocity_m_s = body.velocity_m_s;
    x.body_rate_rad_s = body.rate_rad_s;
    x.attitude = body.attitude;
    x.position_m = body.com_m - rotation_matrix(x.attitude) * from_origin_m;
    look_around(x, p, plan, block, first);
    const typename L::Mask moves = freeze_implausible(x, plan.step_s, block, first);
    if (rarely(!moves)) keep(!moves, load_rows<State<L>>(block.state, first), x);
    store_rows(x, block.state, first);
    lanes.store(moves);
  }
}

}  // namespace

extern const Kernel<float> mean_float;
extern const Kernel<double> mean_double;
const Kernel<float> mean_float{FLAPPY_ISA_NAME, step_mean_block<float>};
const Kernel<double> mean_double{FLAPPY_ISA_NAME, step_mean_block<double>};

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
