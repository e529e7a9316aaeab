// The main loop: the steps of one block of flappers from one control update to the next. Compiled once for each
// instruction set (FLAPPY_ISA); the bits are the same on all of them.
#include "sim/step.hpp"

#include <cstddef>
#include <iterator>

#include "sim/end_of_steps.hpp"
#include "sim/physics_step.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {
namespace {

using namespace model;

/// Driver: new voltages from the wing-beat signal, held until the next update. `held`: present voltages, which stay
/// where they were set directly, clipped to the present limits of the motors.
template <class T, class L>
FLAPPY_INLINE Voltages<L> update_driver(Block<T>& block, const SideParameters<L>& left, const SideParameters<L>& right,
                                        const Voltages<L>& held, int first) {
  T fraction[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i) {
    std::uint32_t& phase = block.phase[first + i];
    fraction[i] = beat_fraction<T>(phase);
    phase += block.phase_per_update[first + i];
  }
  std::uint32_t any_status = 0;
  for (int i = 0; i < kWidth<T>; ++i) any_status |= block.status[first + i];
  const auto d = load_rows<Drive<L>>(block.drive, first);
  const auto clip = [](const L& value, const L& limit) { return clamp(value, L(-limit), limit); };
  const WingBeat<L> u{clamp(d.input.amplitude_V, L(0), d.limit.amplitude_V),
                      clip(d.input.difference_V, d.limit.difference_V), clip(d.input.bias_V, d.limit.bias_V),
                      clip(d.input.split_cycle, d.limit.split_cycle)};
  Voltages<L> next{wing_beat_voltage<+1>(u, L::load(fraction), left.voltage_limit_V),
                   wing_beat_voltage<-1>(u, L::load(fraction), right.voltage_limit_V)};
  if (__builtin_expect((any_status & kDirect) != 0, 0)) {
    T direct[kWidth<T>];
    for (int i = 0; i < kWidth<T>; ++i) direct[i] = (block.status[first + i] & kDirect) != 0 ? T(1) : T(0);
    const auto is_set = L::load(direct) > L(0);
    next = {where(is_set, clip(held.left_V, left.voltage_limit_V), next.left_V),
            where(is_set, clip(held.right_V, right.voltage_limit_V), next.right_V)};
  }
  return next;
}

template <class T, class L>
FLAPPY_INLINE Voltages<L> next_recorded(const T*& voltages_V, int first) {
  const Voltages<L> v{L::load(voltages_V + first), L::load(voltages_V + kLanes<T> + first)};
  voltages_V += 2 * kLanes<T>;
  return v;
}

/// Energy that motors draw while the driver holds its voltage. Every step advances a stroke by h psi' of the step's
/// end, so the sum of V i h over the steps is
///   sum of V (V - K N psi')/R h = V (V T - K N (psi_end - psi_begin))/R
/// and needs only the strokes at the ends of the hold.
template <class T, class L>
class EnergyMeter {
 public:
  EnergyMeter(MotorRows<T>* motors, int first, const State<L>& x)
      : motors_(motors), first_(first), left_rad_(x.left.stroke_rad), right_rad_(x.right.stroke_rad) {}
  /// Adds the energy of the last `seconds`, in which the voltages were `u`.
  FLAPPY_INLINE void read(const State<L>& x, const Voltages<L>& u, double seconds) {
    if (motors_ == nullptr) return;
    const auto work = [&](int side, const L& volt, const L& turned_rad) {
      const L conductance_S = L::load(motors_->rows[2 * side] + first_),
              emf = L::load(motors_->rows[2 * side + 1] + first_);
      return L(volt * L(conductance_S * L(volt * L(seconds)) - emf * turned_rad));
    };
    energy_J +=
        work(0, u.left_V, L(x.left.stroke_rad - left_rad_)) + work(1, u.right_V, L(x.right.stroke_rad - right_rad_));
    left_rad_ = x.left.stroke_rad;
    right_rad_ = x.right.stroke_rad;
  }
  /// Adds the energy of the lanes that move; the value of a frozen lane is undefined.
  FLAPPY_INLINE void add(const typename L::Mask& moves) const {
    for (int i = 0; motors_ != nullptr && i < kWidth<T>; ++i)
      if (moves.raw[i]) motors_->energy_J[first_ + i] += static_cast<double>(energy_J.raw[i]);
  }
  L energy_J{0.0};

 private:
  MotorRows<T>* motors_;
  int first_;
  L left_rad_, right_rad_;
};

class Prefetch {
 public:
  Prefetch(const Ahead& ahead, int steps) {
    for (const Ahead::Part& part : ahead.parts) {
      const char* begin = static_cast<const char*>(part.at);
      if (part.bytes > 0)
        parts_[count_++] = {begin, begin + part.bytes, (part.bytes / kLine + steps - 1) / steps * kLine};
    }
  }
  void step() {
    for (int i = 0; i < count_; ++i)
      for (const char* until = parts_[i].at + parts_[i].share; parts_[i].at < until && parts_[i].at < parts_[i].end;
           parts_[i].at += kLine)
        __builtin_prefetch(parts_[i].at, 0, 2);
  }

 private:
  static constexpr std::size_t kLine = 64;
  struct Part {
    const char *at, *end;
    std::size_t share;
  } parts_[std::size(Ahead{}.parts)];
  int count_ = 0;
};

/// Computes the torso's position from the centre of mass; then contact events, freezing, and storing of rows.
template <class T, class L>
FLAPPY_INLINE void finish(State<L>& x, const Vec3<L>& com_m, const Voltages<L>& voltages,
                          const EnergyMeter<T, L>& meter, const Parameters<L>& p, const StepPlan& plan, Block<T>& block,
                          bool touches_with_points, int first) {
  x.position_m = where(x.support > L(0), x.position_m, com_m - rotation_matrix(x.attitude) * centre_of_mass(p, x));
  if (!touches_with_points) look_around(x, p, plan, block, first);
  const typename L::Mask moves = freeze_implausible(x, plan.step_s, block, first);
  if (rarely(!moves)) keep(!moves, load_rows<State<L>>(block.state, first), x);
  store_rows(x, block.state, first);
  meter.add(moves);
  store_rows(voltages, &block.drive[offsetof(Drive<L>, voltages) / sizeof(L)], first);
}

/// Clears the memory of effects and points of contact of frozen flappers, because their last values are undefined.
template <class T>
FLAPPY_INLINE void forget_frozen(BlockEffects<T> effects, const Block<T>& block, int first) {
  for (int i = first; i < first + kWidth<T>; ++i) {
    if (!(block.status[i] & kFrozen)) continue;
    for (int row = 0; row < state_rows(effects.kept); ++row) effects.states[row * kLanes<T> + i] = T(0);
    for (int row = 0; row < effects.contact.points * kRows<Bristle>; ++row)
      effects.contact.memory[row * kLanes<T> + i] = T(0);
  }
}

template <class T, class L>
FLAPPY_INLINE void report_touched(const Touched<L>& touched, Block<T>& block, int first) {
  const auto mark = [&](const L& flag, std::uint32_t bit) {
    const typename L::Mask mask = flag > L(0);
    for (int i = 0; any(mask) && i < kWidth<T>; ++i)
      if (mask.raw[i]) block.status[first + i] |= bit;
  };
  for (int i = 0; i < kWidth<T>; ++i) block.status[first + i] &= ~std::uint32_t{kTouching};
  mark(touched.ground, kTouchedGround);
  mark(touched.ceiling, kTouchedCeiling);
  mark(touched.wall, kTouchedWall);
  mark(touched.shape, kTouchedShape);
  mark(touched.now, kTouching);
}

template <bool with_effects, class T>
void step_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t first_step, int steps,
                const Ahead& ahead) {
  using L = Lanes<T, kWidth<T>>;
  const Constants<L> k{plan.step_s,       plan.step_s / 2, 1 / plan.step_s,
                       plan.gravity_m_s2, plan.ground_z_m, plan.ceiling_z_m};
  Prefetch prefetch(ahead, steps);
  for (int first = 0; first < kLanes<T>; first += kWidth<T>) {
    const auto& p = view_rows<Parameters<L>>(block.parameters, first);
    auto x = load_rows<State<L>>(block.state, first);
    Voltages<L> voltages = load_rows<Drive<L>>(block.drive, first).voltages;
    ActiveEffects<L> effects;
    Parameters<L> own;
    Touched<L> touched;
    if constexpr (with_effects) {
      own = p;
      activate(in_force, plan, first, own, touched, effects);
    }
    Vec3<L> com_m = x.position_m + rotation_matrix(x.attitude) * centre_of_mass(p, x);
    L reach_rad(0);
    if constexpr (with_effects) reach_rad = reach_beyond_stops(effects);
    shift_positions<with_effects>(p, reach_rad, k.half_step, x, com_m);

    EnergyMeter<T, L> meter(in_force.motors, first, x);
    if constexpr (with_effects) {
      if (in_force.motors != nullptr) effects.motors = in_force.motors->rows[0] + first;
      effects.energy_J = &meter.energy_J;
    }
    int held = 0;  // steps since the last reading of the meter
    const auto measure = [&] {
      meter.read(x, voltages, held * plan.step_s);
      held = 0;
    };
    const T* recorded_V = in_force.voltages_V;
    std::int64_t until_update = (plan.steps_per_update - first_step % plan.steps_per_update) % plan.steps_per_update;
    for (int i = 0; i < steps; ++i, --until_update) {
      if (until_update == 0) {
        measure();
        voltages = recorded_V != nullptr ? next_recorded<T, L>(recorded_V, first)
                                         : update_driver(block, p.left, p.right, voltages, first);
        until_update = plan.steps_per_update;
      }
      prefetch.step();
      physics_step<with_effects>(p, x, voltages, com_m, effects, k);
      ++held;
      if (with_effects && effects.meter != nullptr) effects.meter += kMeterRows * kLanes<T>;
    }
    measure();
    shift_positions<with_effects>(p, reach_rad, L(-k.half_step), x, com_m);
    const bool with_points = with_effects && in_force.contact.points > 0;
    if (with_points) report_touched(touched, block, first);
    finish(x, com_m, voltages, meter, p, plan, block, with_points, first);
    if constexpr (with_effects) forget_frozen(in_force, block, first);
  }
}

template <class T>
void step_any_block(Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan, std::int64_t first, int steps,
                    const Ahead& ahead) {
  if (in_force.set == 0 && in_force.meter == nullptr && in_force.contact.points == 0)
    step_block<false>(block, in_force, plan, first, steps, ahead);
  else step_block<true>(block, in_force, plan, first, steps, ahead);
}

}  // namespace

extern const Kernel<float> kernel_float;
extern const Kernel<double> kernel_double;
const Kernel<float> kernel_float{FLAPPY_ISA_NAME, step_any_block<float>};
const Kernel<double> kernel_double{FLAPPY_ISA_NAME, step_any_block<double>};

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
