// The main loop: what one block of flappers does from one control update to the next, stage by stage.
// Compiled once for each instruction set (FLAPPY_ISA); the bits are the same on all of them.
#include "sim/step.hpp"

#include "model/effects/registry.hpp"
#include "model/motor.hpp"
#include "model/vehicle_dynamics.hpp"
#include "model/wing_aerodynamics.hpp"
#include "sim/lanes.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {
namespace {

using namespace model;

#if defined(FLAPPY_SCALAR)
template <class T>
constexpr int kWidth = 1;
#elif defined(__AVX512F__)
template <class T>
constexpr int kWidth = 64 / sizeof(T);
#elif defined(__AVX2__)
template <class T>
constexpr int kWidth = 32 / sizeof(T);
#else
template <class T>
constexpr int kWidth = 16 / sizeof(T);
#endif

/// A flapper that goes faster than this is not flying but diverging.
constexpr double kPlausibleSpeed_m_s = 100;
constexpr double kPlausibleBodyRate_rad_s = 1000;
constexpr double kPlausibleHingeRate_rad_s = 20000;  // the published limit of the rotation joint is 2000
constexpr double kPlausiblePosition_m = 10000;
/// A flapper that rose this far has left its support: touching the ground is an event from then on.
constexpr double kTakeOffClearance_m = 0.005;

template <class S, class T, int lanes>
FLAPPY_INLINE S load_rows(const T (*rows)[lanes], int first) {
  S s;
  using L = Lanes<T, kWidth<T>>;
  static_assert(sizeof(S) % sizeof(L) == 0);
  L* to = reinterpret_cast<L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) to[i] = L::load(rows[i] + first);
  return s;
}

template <class S, class T, int lanes>
FLAPPY_INLINE void store_rows(const S& s, T (*rows)[lanes], int first) {
  using L = Lanes<T, kWidth<T>>;
  const L* from = reinterpret_cast<const L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) from[i].store(rows[i] + first);
}

/// Driver: new voltages from the wing-beat signal, held until the next update.
template <class T, class L>
FLAPPY_INLINE void update_driver(Drive<L>& d, const Parameters<L>& p, Block<T>& block, int first) {
  T fraction[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i) {
    std::uint32_t& phase = block.phase[first + i];
    fraction[i] = static_cast<T>(static_cast<std::int32_t>(phase)) * static_cast<T>(0x1p-32);
    phase += block.phase_per_update[first + i];
  }
  const auto clip = [](const L& value, const L& limit) { return clamp(value, L(-limit), limit); };
  const WingBeat<L> u{clamp(d.input.amplitude_V, L(0), d.limit.amplitude_V),
                      clip(d.input.difference_V, d.limit.difference_V), clip(d.input.bias_V, d.limit.bias_V),
                      clip(d.input.split_cycle, d.limit.split_cycle)};
  d.left_V = wing_beat_voltage<+1>(u, L::load(fraction), p.left.voltage_limit_V);
  d.right_V = wing_beat_voltage<-1>(u, L::load(fraction), p.right.voltage_limit_V);
}

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
  if (any(held)) {
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
  if (any(held)) {
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

/// Marks flappers that have come apart or touched something, and stands those that never took off back up.
template <class T, class L>
FLAPPY_INLINE void look_around(State<L>& x, const Parameters<L>& p, const World& world, Block<T>& block,
                               int first) {
  const auto mark = [&](typename L::Mask mask, std::uint32_t bit) {
    if (!any(mask)) return;
    for (int i = 0; i < kWidth<T>; ++i)
      if (mask.raw[i]) block.status[first + i] |= bit;
  };
  const auto flying = x.support <= L(0);
  const L height = x.position_m.z - (L(world.ground_z_m) + p.below_m);
  const auto lifting = x.support < L(0);
  if (any(lifting)) {
    const auto fell_back = lifting & (height < L(0));
    const L zero(0);
    x.position_m.z = where(fell_back, L(x.position_m.z - height), x.position_m.z);
    x.body_rate_rad_s = where(fell_back, Vec3<L>{zero, zero, zero}, x.body_rate_rad_s);
    x.support = where(fell_back, L(1), where(lifting & (height > L(kTakeOffClearance_m)), zero, x.support));
  }
  mark(flying & !lifting & (height < L(0)), kTouchedGround);
  mark(flying & (x.position_m.z + p.above_m > L(world.ceiling_z_m)), kTouchedCeiling);
  for (const Wall& w : world.walls) {
    const L clearance =
        L(w.normal_x) * L(x.position_m.x - L(w.x_m)) + L(w.normal_y) * L(x.position_m.y - L(w.y_m));
    mark(flying & (clearance < p.around_m), kTouchedWall);
  }
}

template <class L>
FLAPPY_INLINE typename L::Mask plausible(const State<L>& x) {
  const auto within = [](const L& v, double limit) { return abs(v) <= L(limit); };  // false for NaN
  const auto all = [&](const Vec3<L>& v, double limit) {
    return within(v.x, limit) & within(v.y, limit) & within(v.z, limit);
  };
  const auto side = [&](const SideState<L>& q) {
    return within(q.stroke_rad, kLargestAngle_rad) & within(q.rotation_rad, kLargestAngle_rad) &
           within(q.stroke_rate_rad_s, kPlausibleHingeRate_rad_s) &
           within(q.rotation_rate_rad_s, kPlausibleHingeRate_rad_s);
  };
  return all(x.position_m, kPlausiblePosition_m) & all(x.com_velocity_m_s, kPlausibleSpeed_m_s) &
         all(x.body_rate_rad_s, kPlausibleBodyRate_rad_s) & within(x.attitude.w, 2) & side(x.left) &
         side(x.right);
}

/// Freezes what is no longer plausible; true for lanes that may move on.
template <class T, class L>
FLAPPY_INLINE typename L::Mask freeze_implausible(const State<L>& x, Block<T>& block, int first) {
  typename L::Mask moves = plausible(x);
  for (int i = 0; i < kWidth<T>; ++i) {
    std::uint32_t& status = block.status[first + i];
    if (!moves.raw[i]) status |= kFrozen;
    if (status & kFrozen) moves.raw[i] = 0;
  }
  return moves;
}

template <class L>
FLAPPY_INLINE State<L> where(typename L::Mask m, State<L> yes, const State<L>& no) {
  L* a = reinterpret_cast<L*>(&yes);
  const L* b = reinterpret_cast<const L*>(&no);
  for (int i = 0; i < kStateRows; ++i) a[i] = where(m, a[i], b[i]);
  return yes;
}

/// Fetches a block from memory, a share with every step.
class Prefetch {
 public:
  Prefetch(const void* from, std::size_t bytes, int steps)
      : at_(static_cast<const char*>(from)),
        end_(at_ + (from != nullptr ? bytes : 0)),
        share_((bytes / kLine + steps - 1) / steps * kLine) {}
  void step() {
    for (const char* until = at_ + share_; at_ < until && at_ < end_; at_ += kLine)
      __builtin_prefetch(at_, 1);
  }

 private:
  static constexpr std::size_t kLine = 64;
  const char *at_, *end_;
  std::size_t share_;
};

template <bool with_effects, class T>
void step_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t first_step,
                int steps, const Block<T>* next) {
  using L = Lanes<T, kWidth<T>>;
  const Constants<L> k{plan.step_s,           plan.step_s / 2,       1 / plan.step_s, plan.world.gravity_m_s2,
                       plan.world.ground_z_m, plan.world.ceiling_z_m};
  Prefetch prefetch(next, sizeof *next, steps);
  for (int first = 0; first < kLanes<T>; first += kWidth<T>) {
    const auto p = load_rows<Parameters<L>>(block.parameters, first);
    auto drive = load_rows<Drive<L>>(block.drive, first);
    const auto before = load_rows<State<L>>(block.state, first);
    ActiveEffects<L> effects;
    if constexpr (with_effects) {
      effects.set = in_force.set;
      for (int i = 0; i < kEffectRows; ++i)
        effects.parameters[i] = L::load(in_force.rows + i * kLanes<T> + first);
    }

    State<L> x = before;
    Vec3<L> com_m = x.position_m + rotation_matrix(x.attitude) * centre_of_mass(p, x);
    int until_update = static_cast<int>((plan.steps_per_update - first_step % plan.steps_per_update) %
                                        plan.steps_per_update);
    for (int i = 0; i < steps; ++i, --until_update) {
      if (until_update == 0) {
        update_driver(drive, p, block, first);
        until_update = plan.steps_per_update;
      }
      prefetch.step();
      physics_step<with_effects>(p, x, drive, com_m, effects, k);
    }
    x.position_m =
        where(x.support > L(0), x.position_m, com_m - rotation_matrix(x.attitude) * centre_of_mass(p, x));

    look_around(x, p, plan.world, block, first);
    const typename L::Mask moves = freeze_implausible(x, block, first);
    store_rows(where(moves, x, before), block.state, first);
    store_rows(drive, block.drive, first);
  }
}

template <class T>
void step_any_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t first,
                    int steps, const Block<T>* next) {
  if (in_force.set == 0)
    step_block<false>(block, in_force, plan, first, steps, next);
  else
    step_block<true>(block, in_force, plan, first, steps, next);
}

}  // namespace

extern const Kernel<float> kernel_float;
extern const Kernel<double> kernel_double;
const Kernel<float> kernel_float{FLAPPY_ISA_NAME, step_any_block<float>};
const Kernel<double> kernel_double{FLAPPY_ISA_NAME, step_any_block<double>};

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
