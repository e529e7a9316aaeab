// The step of vehicles with articulated wings: a gait prescribes the driven angles, model/jointed_dynamics.hpp solves
// for the rest. Positions, free angles and the clock of the beat drift for half a step. In the middle, accelerations,
// computed with the rates u + h/2 u'(previous step), change the rates; then positions drift on with the new ones
// (leapfrog, rates by Adams and Bashforth: of second order). Driven angles are exactly the gait's in the middle.
// Compiled once per instruction set (FLAPPY_ISA), with the same bits.
#include <cstddef>
#include <type_traits>

#include "sim/end_of_steps.hpp"
#include "sim/jointed_block.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {
namespace {

using Mode = Jointed::Mode;

template <class L>
using Angles = Sides<Moving<L>[kJoints]>;

template <class T>
class JointedLanes {
  using L = Lanes<T, kWidth<T>>;

 public:
  JointedLanes(const JointedRows<T>& jointed, const Block<T>& block, const StepPlan& plan, int first)
      : own_(jointed),
        shape_(*jointed.shape),
        first_(first),
        step_(plan.step_s),
        half_(plan.step_s / 2),
        p_(view_rows<JointedParameters<L>>(rows(0), first)),
        block_(view_rows<Parameters<L>>(block.parameters, first)),
        m_(load_rows<JointedMemory<L>>(memory(), first)) {}

  void set_inputs(const WingBeat<L>& says, const State<L>& x) {
    const L four[] = {says.amplitude_V, says.difference_V, says.bias_V, says.split_cycle};
    for (int k = 0; k < shape_.inputs; ++k) {
      const auto input = load_rows<JointedInput<L>>(rows(shape_.input_row + k * model::kRows<JointedInput>), first_);
      L sum = input.neutral;
      for (int i = 0; i < 4; ++i) sum += input.mix[i] * four[i];
      wanted_[k] = clamp(sum, input.low, input.high);
      follows_[k] = input.follows;
    }
    start_fresh(x);
  }

  /// Advances clock and free angles by half a step, forward or backward.
  void drift(const L& time_s) {
    m_.clock += time_s * frequency();
    for_free([&](int side, int j) { m_.angle_rad[side][j] += time_s * m_.rate_rad_s[side][j]; });
  }

  /// Advances inputs, clock and free angles from the middle of a step to the middle of the next.
  void drift_on() {
    for (int k = 0; k < shape_.inputs; ++k) follow(follows_[k], wanted_[k], m_.input[k], m_.input_rate[k]);
    m_.clock += step_ * frequency();
    m_.clock -= nearest(m_.clock);
    for_free([&](int side, int j) { m_.angle_rad[side][j] += step_ * m_.rate_rad_s[side][j]; });
  }

  /// Advances the inputs to the middle of the step, and computes the angles from inputs and clock.
  void move_wings(Angles<L>& q) {
    Moving<L> u[kMaxInputs];
    for (int k = 0; k < shape_.inputs; ++k) {
      follow(follows_[k], wanted_[k], m_.input[k], m_.input_rate[k]);
      u[k] = moving(follows_[k], wanted_[k], m_.input[k], m_.input_rate[k]);
    }
    const L zero(0), one(1);
    const Moving<L> still{zero, zero, zero};
    Moving<L> frequency{one, zero, zero}, timing[kSides] = {still, still}, scale[kSides][kJoints],
                                          offset[kSides][kJoints];
    for (int side = 0; side < kSides; ++side)
      for (int j = 0; j < kJoints; ++j) {
        scale[side][j] = {one, zero, zero};
        offset[side][j] = {joint(side, j).mean_rad, zero, zero};
      }
    for (int i = 0; i < shape_.modulations; ++i) {
      const Modulation& a = own_.modulations[i];
      Moving<L>& to = a.of == Modulation::Of::frequency ? frequency
                      : a.of == Modulation::Of::timing  ? timing[a.side]
                      : a.of == Modulation::Of::scale   ? scale[a.side][a.joint]
                                                        : offset[a.side][a.joint];
      to = add_scaled(to, row(shape_.modulation_row + i), u[a.input]);
    }
    const L& f0 = p_.frequency_Hz;
    frequency = {f0 * frequency.value, f0 * frequency.rate, f0 * frequency.acceleration};
    const SinCos<L> turn = turn_of(m_.clock);
    BeatPhase<L> phase[kSides];
    for (int side = 0; side < kSides; ++side)
      phase[side] =
          shape_.timed[side] ? timed_phase(m_.clock, turn, frequency, timing[side]) : untimed_phase(turn, frequency);
    const bool once = shape_.same_gait && !shape_.timed[0] && !shape_.timed[1];
    Moving<L> g[kJoints];
    for (int side = 0; side < kSides; ++side)
      for (int j = 0; j < kJoints; ++j) {
        Moving<L>& to = side == 0 ? q.left[j] : q.right[j];
        const Mode mode = shape_.modes[side][j];
        if (mode == Mode::free) {
          to = {m_.angle_rad[side][j], m_.rate_rad_s[side][j] + half_ * m_.acceleration_rad_s2[side][j], zero};
        } else if (mode == Mode::fixed) {
          to = offset[side][j];
        } else {
          const T(*at)[kLanes<T>] = rows(shape_.harmonic_row[side][j]);
          if (side == 0 || !once)
            g[j] = harmonics(
                phase[side], static_cast<std::size_t>(shape_.harmonics[side][j]),
                [&](std::size_t k) { return L::load(at[2 * k] + first_); },
                [&](std::size_t k) { return L::load(at[2 * k + 1] + first_); });
          to = modulated(g[j], scale[side][j], offset[side][j]);
        }
      }
  }

  /// Air at the shoulder in E, and pulls of free angles. `shoulder_m_s`: its velocity in the air, in B.
  template <int s>
  JointedLoad<L> load_side(const JointedPose<L>& g, const Vec3<L>& shoulder_m_s) const {
    constexpr int kSide = s > 0 ? 0 : 1;
    const JointedSide<L>& p = s > 0 ? p_.left : p_.right;
    JointedLoad<L> load;
    load.air_speed_m_s = g.to_E(shoulder_m_s);
    if (shape_.strips[kSide] == 0) {
      const WingWrench<L> air =
          blade_element<s>(s > 0 ? block_.left : block_.right, g.theta, g.wing_rate.y, load.air_speed_m_s, g.edge_rate);
      load.force_N = {air.force_x_N, L(0), air.force_z_N};
      load.moment_Nm = air.moment_Nm;
    } else {
      const Vec3<L> v = g.to_wing(load.air_speed_m_s), w = g.to_wing(g.wing_rate);
      WingLoad<L> air = no_load<L>();
      const auto series = load_rows<SeriesOfForce<L>>(rows(shape_.series_row[kSide]), first_);
      for (int i = 0; i < shape_.strips[kSide]; ++i)
        add_strip(load_rows<Strip<L>>(rows(shape_.strip_row[kSide] + i * model::kRows<Strip>), first_), series,
                  shape_.slides[kSide], v, w, air);
      add_pitching_drag(p, w.y, air);
      load.force_N = g.from_wing(air.force_N);
      load.moment_Nm = g.from_wing(air.moment_Nm);
    }
    const L zero(0);
    for (int j = 0; j < kJoints; ++j) {
      load.pulls[j] = {zero, zero};
      if (shape_.modes[kSide][j] != Mode::free) continue;
      load.pulls[j] = pull_of(p.joints[j], m_.angle_rad[kSide][j], m_.rate_rad_s[kSide][j], step_);
      if (j != kRotation) continue;
      // may be stiff for a light wing: it acts as inertia, relative to the acceleration of the last step
      const L damped = L(step_ * L(p.rotational_damping_Nm_s2 * abs(g.wing_rate.y)));
      load.pulls[j].inertia_kg_m2 += damped;
      load.pulls[j].torque_Nm += damped * m_.acceleration_rad_s2[kSide][j];
    }
    return load;
  }

  void take(const JointedMotion<L>& motion, const Angles<L>& q) {
    m_.acceleration_B_m_s2 = motion.acceleration_m_s2;
    m_.angular_acceleration_rad_s2 = motion.angular_acceleration_rad_s2;
    L positive(0), all(0);
    for (int side = 0; side < kSides; ++side) {
      L power(0);
      for (int j = 0; j < kJoints; ++j) {
        const Moving<L>& angle = side == 0 ? q.left[j] : q.right[j];
        const L& acceleration = (side == 0 ? motion.joint_rad_s2.left : motion.joint_rad_s2.right)[j];
        const L& torque = (side == 0 ? motion.torque_Nm.left : motion.torque_Nm.right)[j];
        m_.acceleration_rad_s2[side][j] = acceleration;
        m_.torque_Nm[side][j] = torque;
        if (shape_.modes[side][j] == Mode::free) {
          m_.rate_rad_s[side][j] += step_ * acceleration;
          continue;
        }
        const JointParameters<L>& own = joint(side, j);
        const L muscle =
            torque + L(own.stiffness_Nm_rad * L(angle.value - own.rest_rad) + own.damping_Nm_s * angle.rate);
        m_.torque_Nm[side][j] = muscle;
        m_.angle_rad[side][j] = angle.value + half_ * L(angle.rate + L(0.5) * L(half_ * angle.acceleration));
        m_.rate_rad_s[side][j] = angle.rate + half_ * angle.acceleration;
        power += muscle * angle.rate;
      }
      positive += max(power, L(0));
      all += power;
    }
    positive_J += step_ * positive;
    all_J += step_ * all;
  }

  JointedMotion<L> accelerate_at(const Angles<L>& q, const Vec3<L>& velocity_B, const Vec3<L>& w,
                                 const Vec3<L>& gravity_B, const typename L::Mask& held, Vec3<L>& air_force_B,
                                 Vec3<L>& air_moment_B) const {
    const Sides<JointedPose<L>> pose{place_side<+1>(p_.left, q.left, w), place_side<-1>(p_.right, q.right, w)};
    const Sides<JointedLoad<L>> load{load_side<+1>(pose.left, velocity_B + cross(w, p_.left.shoulder_m)),
                                     load_side<-1>(pose.right, velocity_B + cross(w, p_.right.shoulder_m))};
    const Vec3<L> left = pose.left.to_B(load.left.force_N), right = pose.right.to_B(load.right.force_N);
    air_force_B = left + right;
    if (rarely(held))
      air_moment_B = (pose.left.to_B(load.left.moment_Nm) + pose.right.to_B(load.right.moment_Nm)) +
                     (cross(p_.left.shoulder_m, left) + cross(p_.right.shoulder_m, right));
    return model::accelerate(p_, pose, q, load, w, gravity_B, shape_.free, shape_.unknowns, shape_.carries_air, held);
  }

  const JointedMemory<L>& memory_now() const { return m_; }

  /// Copies stroke and rotation of the wings to State, for observers.
  void show(State<L>& x) const {
    const auto side = [&](int s, SideState<L>& to) {
      to.stroke_rad = m_.angle_rad[s][kStroke];
      to.rotation_rad = m_.angle_rad[s][kRotation];
      to.stroke_rate_rad_s = m_.rate_rad_s[s][kStroke];
      to.rotation_rate_rad_s = m_.rate_rad_s[s][kRotation];
      to.stroke_rate_before_rad_s = to.stroke_rate_rad_s - step_ * m_.acceleration_rad_s2[s][kStroke];
      to.rotation_rate_before_rad_s = to.rotation_rate_rad_s - step_ * m_.acceleration_rad_s2[s][kRotation];
    };
    side(0, x.left);
    side(1, x.right);
  }

  /// Lanes whose stroke plane and deviation are within kLargestAngle_rad; plausible() checks stroke and rotation.
  typename L::Mask possible() const {
    const L limit(kLargestAngle_rad);
    auto all = abs(m_.angle_rad[0][kPlane]) <= limit;
    for (int side = 0; side < kSides; ++side)
      for (const int j : {int{kPlane}, int{kDeviation}}) all = all & (abs(m_.angle_rad[side][j]) <= limit);
    return all;
  }

  /// Stores the memory of the lanes in `moves`, and adds their work.
  void store(const typename L::Mask& moves, Block<T>& block) const {
    const auto before = load_rows<JointedMemory<L>>(memory(), first_);
    const L *from = reinterpret_cast<const L*>(&m_), *old = reinterpret_cast<const L*>(&before);
    for (int r = 0; r < model::kRows<JointedMemory>; ++r)
      where(moves, from[r], old[r]).store(own_.memory + r * kLanes<T> + first_);
    for (int i = 0; i < kWidth<T>; ++i) {
      if (!moves.raw[i]) continue;
      own_.work_J[first_ + i] += static_cast<double>(positive_J.raw[i]);
      own_.work_J[kLanes<T> + first_ + i] += static_cast<double>(all_J.raw[i]);
      block.phase[first_ + i] =
          static_cast<std::uint32_t>(static_cast<std::int64_t>(static_cast<double>(m_.clock.raw[i]) * 0x1p32));
    }
  }

 private:
  const T (*rows(int row) const)[kLanes<T>] { return reinterpret_cast<const T(*)[kLanes<T>]>(own_.rows) + row; }
  const T (*memory() const)[kLanes<T>] { return reinterpret_cast<const T(*)[kLanes<T>]>(own_.memory); }
  L row(int r) const { return L::load(rows(r)[0] + first_); }
  const JointParameters<L>& joint(int side, int j) const { return (side == 0 ? p_.left : p_.right).joints[j]; }

  void for_free(const auto& use) const {
    if (shape_.unknowns == kBodyUnknowns) return;
    for (int side = 0; side < kSides; ++side)
      for (int j = 0; j < kJoints; ++j)
        if (shape_.modes[side][j] == Mode::free) use(side, j);
  }

  L frequency() const {
    L factor(1);
    for (int i = 0; i < shape_.modulations; ++i)
      if (own_.modulations[i].of == Modulation::Of::frequency)
        factor += row(shape_.modulation_row + i) * m_.input[own_.modulations[i].input];
    return p_.frequency_Hz * factor;
  }

  /// Initialises a vehicle that has not flown yet: inputs as if the first ones had been held for long, free strokes and
  /// rotations from State, other free angles at rest.
  void start_fresh(const State<L>& x) {
    const auto fresh = m_.flown == L(0);
    if (!any(fresh)) return;
    const L zero(0);
    m_.flown = L(1);
    const auto clear = [&](L& number) { number = where(fresh, zero, number); };
    clear(m_.clock);
    for (int k = 0; k < shape_.inputs; ++k) {
      m_.input[k] = where(fresh, wanted_[k], m_.input[k]);
      clear(m_.input_rate[k]);
    }
    for (L* number :
         {&m_.acceleration_B_m_s2.x, &m_.acceleration_B_m_s2.y, &m_.acceleration_B_m_s2.z,
          &m_.angular_acceleration_rad_s2.x, &m_.angular_acceleration_rad_s2.y, &m_.angular_acceleration_rad_s2.z})
      clear(*number);
    for_free([&](int side, int j) {
      const SideState<L>& seen = side == 0 ? x.left : x.right;
      L angle = joint(side, j).rest_rad, rate = zero;
      if (j == kStroke) angle = seen.stroke_rad, rate = seen.stroke_rate_rad_s;
      if (j == kRotation) angle = seen.rotation_rad, rate = seen.rotation_rate_rad_s;
      m_.angle_rad[side][j] = where(fresh, angle, m_.angle_rad[side][j]);
      m_.rate_rad_s[side][j] = where(fresh, rate, m_.rate_rad_s[side][j]);
      clear(m_.acceleration_rad_s2[side][j]);
    });
  }

  const JointedRows<T>& own_;
  const JointedShape& shape_;
  int first_;
  const L step_, half_;
  // references if lanes fill a row, as view_rows() returns them
  template <class S>
  using View = std::conditional_t<kWidth<T> == kLanes<T>, const S&, const S>;
  View<JointedParameters<L>> p_;
  View<Parameters<L>> block_;
  JointedMemory<L> m_;
  L wanted_[kMaxInputs];
  InputFilter<L> follows_[kMaxInputs];
  L positive_J{0.0}, all_J{0.0};
};

/// Adds to support impulse and averaged lift of a held body; releases a standing body once that lift carries it.
template <class L>
FLAPPY_INLINE void feel(const Parameters<L>& p, const Vec3<L>& force_B, const Vec3<L>& moment_B, const Matrix3<L>& R,
                        const StepPlan& plan, const typename L::Mask& held, State<L>& x) {
  const L step(plan.step_s);
  x.impulse_N_s = where(held, add_scaled(x.impulse_N_s, step, force_B), x.impulse_N_s);
  x.angular_impulse_Nm_s = where(held, add_scaled(x.angular_impulse_Nm_s, step, moment_B), x.angular_impulse_Nm_s);
  x.lift_N = where(held, L(x.lift_N + L(dot(R.row_z, force_B) - x.lift_N) / p.beat_steps), x.lift_N);
  const auto carried = (x.support == L(1)) & (x.lift_N * p.inverse_mass_1_kg > L(plan.gravity_m_s2));
  x.support = where(carried, L(-1), x.support);
}

template <class T>
void step_jointed_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t, int steps,
                        const Ahead&) {
  using L = Lanes<T, kWidth<T>>;
  const L step(plan.step_s), half(plan.step_s / 2), gravity(plan.gravity_m_s2);
  for (int first = 0; first < kLanes<T>; first += kWidth<T>) {
    const auto& p = view_rows<Parameters<L>>(block.parameters, first);
    auto x = load_rows<State<L>>(block.state, first);
    JointedLanes<T> lanes(*in_force.jointed, block, plan, first);
    lanes.set_inputs(load_rows<Drive<L>>(block.drive, first).input, x);
    const auto shift = [&](const L& time_s) {
      lanes.drift(time_s);
      x.position_m = add_scaled(x.position_m, time_s, x.com_velocity_m_s);
      x.attitude = rotated(x.attitude, L(L(0.5) * time_s) * x.body_rate_rad_s);
    };
    const auto stay = [&](const State<L>& before) {
      const auto held = x.support > L(0);
      if (!rarely(held)) return held;
      const Vec3<L> none{L(0), L(0), L(0)};
      x.position_m = where(held, before.position_m, x.position_m);
      x.attitude = {where(held, before.attitude.w, x.attitude.w), where(held, before.attitude.x, x.attitude.x),
                    where(held, before.attitude.y, x.attitude.y), where(held, before.attitude.z, x.attitude.z)};
      x.com_velocity_m_s = where(held, none, x.com_velocity_m_s);
      x.body_rate_rad_s = where(held, none, x.body_rate_rad_s);
      return held;
    };
    const State<L> before = x;
    stay(before);
    shift(half);
    for (int i = 0; i < steps; ++i) {
      const auto held = x.support > L(0);
      Angles<L> q;
      lanes.move_wings(q);
      const Matrix3<L> R = rotation_matrix(x.attitude);
      const JointedMemory<L>& last = lanes.memory_now();
      const Vec3<L> v = add_scaled(transpose_times(R, x.com_velocity_m_s), half, last.acceleration_B_m_s2),
                    w = add_scaled(x.body_rate_rad_s, half, last.angular_acceleration_rad_s2);
      Vec3<L> force_B, moment_B;
      const JointedMotion<L> a = lanes.accelerate_at(q, v, w, L(-gravity) * R.row_z, held, force_B, moment_B);
      lanes.take(a, q);
      x.com_velocity_m_s = add_scaled(x.com_velocity_m_s, step, R * a.acceleration_m_s2);
      x.body_rate_rad_s = add_scaled(x.body_rate_rad_s, step, a.angular_acceleration_rad_s2);
      x.position_m = add_scaled(x.position_m, step, x.com_velocity_m_s);
      x.attitude = rotated(x.attitude, half * x.body_rate_rad_s);
      lanes.drift_on();
      if (rarely(held)) {
        stay(before);
        feel(p, force_B, moment_B, R, plan, held, x);
      }
    }
    shift(L(-half));
    lanes.show(x);
    look_around(x, p, plan, block, first);
    const auto possible = lanes.possible();
    if (rarely(!possible))
      for (int i = 0; i < kWidth<T>; ++i)
        if (!possible.raw[i]) block.status[first + i] |= kFrozen;
    const typename L::Mask moves = freeze_implausible(x, plan.step_s, block, first);
    if (rarely(!moves)) keep(!moves, load_rows<State<L>>(block.state, first), x);
    store_rows(x, block.state, first);
    lanes.store(moves, block);
  }
}

}  // namespace

extern const Kernel<float> jointed_float;
extern const Kernel<double> jointed_double;
const Kernel<float> jointed_float{FLAPPY_ISA_NAME, step_jointed_block<float>};
const Kernel<double> jointed_double{FLAPPY_ISA_NAME, step_jointed_block<double>};

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
