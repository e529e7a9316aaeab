// One control period of a block of flappers. Compiled once per instruction set (FLAPPY_ISA), with the same bits.
#if !defined(__x86_64__)
#include <chrono>
#endif

#include "flight/flight_block.hpp"
#include "flight/sensor_effects.hpp"
#include "sim/rows.hpp"

namespace flappy::flight {
inline namespace FLAPPY_ISA {
namespace {

using sim::kWidth;
using sim::load_rows;
using sim::store_rows;
using sim::view_rows;

template <class T>
using L = Lanes<T, kWidth<T>>;

template <class T, class Stage>
FLAPPY_INLINE void for_lanes(const Stage& stage) {
  for (int first = 0; first < kLanes<T>; first += kWidth<T>) stage(first);
}

template <class T>
FLAPPY_INLINE T (*slot(T* rows, int index, int rows_in_slot))[kLanes<T>] {
  return reinterpret_cast<T(*)[kLanes<T>]>(rows) + static_cast<std::ptrdiff_t>(index) * rows_in_slot;
}

template <class T>
FLAPPY_INLINE Setpoint<L<T>> setpoint(FlightBlock<T>& f, const FlightPlan<T>& plan, int first) {
  return setpoint_at<L<T>>(plan.path, f.tick + first, f.segment + first);
}

/// The actor acts in the lanes in which its last action has been held for action_repeat control periods.
template <class T>
FLAPPY_INLINE void act(const FlightSpace<T>& s, const FlightPlan<T>& plan, Episode<L<T>>& episode, int first) {
  const FlightBlock<T>& f = s.flight;
  T due[kWidth<T>], index[kWidth<T>];
  bool any_due = false;
  for (int i = 0; i < kWidth<T>; ++i) {
    index[i] = static_cast<T>(f.flapper[first + i] - plan.first_flapper);
    due[i] = f.tick[first + i] % plan.action_repeat == 0 ? T(1) : T(0);
    any_due |= due[i] > 0;
  }
  if (!any_due) return;
  const auto acts = L<T>::load(due) > L<T>(0);
  L<T> observation[kMaxHistory * kMaxObservation], action[kMaxActions], memory[policy::kMaxMemory];
  for (int i = 0; i < plan.observed; ++i) observation[i] = L<T>::load(f.observation[i] + first);
  L<T>* const past = observation + plan.observed;
  for (int i = 0; i < plan.past; ++i) past[i] = L<T>::load(s.past + i * kLanes<T> + first);
  const int units = plan.actor.memory();
  for (int k = 0; k < units; ++k) memory[k] = L<T>::load(s.memory + k * kLanes<T> + first);
  evaluate(plan.actor, observation, action, memory);
  for (int k = 0; k < units; ++k) {
    T* const kept = s.memory + k * kLanes<T> + first;
    where(acts, memory[k], L<T>::load(kept)).store(kept);
  }
  for (int i = 0; i < plan.past; ++i) where(acts, observation[i], past[i]).store(s.past + i * kLanes<T> + first);
  if (plan.explores) {
    const auto fresh = sim::normals<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::exploration), plan.period,
                                          f.flapper + first, f.flight + first);
    const L<T> size = L<T>(plan.noise_low) + L<T>(plan.noise_more) * L<T>::load(index);
    for (int i = 0; i < plan.actions; ++i) {
      const L<T> noise = L<T>(plan.noise_kept) * episode.noise[i] + L<T>(plan.noise_fresh) * fresh.n[i];
      episode.noise[i] = where(acts, noise, episode.noise[i]);
      action[i] = clamp(L<T>(action[i] + size * noise), L<T>(-1), L<T>(1));
    }
  }
  for (int i = 0; i < plan.actions; ++i) {
    episode.action[i] = where(acts, action[i], episode.action[i]);
    episode.adds[i] = where(acts, scaled_action(plan.task, i, action[i]), episode.adds[i]);
  }
  episode.action_reward = where(acts, L<T>(0), episode.action_reward);
  store_rows(episode, s.flight.episode, first);
}

/// Counter of the draw that each flight makes once; those of samples and control periods never reach it.
constexpr std::uint32_t kOfFlight = 0xFFFFFFFF;

/// Until the present action acts, the one before does. Inference and transport take another time for each.
template <class T>
FLAPPY_INLINE void come_late(const FlightSpace<T>& s, const FlightPlan<T>& plan, Episode<L<T>>& episode, int first) {
  const FlightBlock<T>& f = s.flight;
  T* const periods = s.late + kMaxActions * kLanes<T> + first;
  T waits[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i) {
    const std::uint32_t since = f.tick[first + i] % plan.action_repeat;
    if (since == 0) {
      using One = Lanes<T, 1>;
      const auto at_most = [&](std::uint32_t most, std::uint32_t number) {
        const T share = sim::uniforms<One>(plan.seed, static_cast<std::uint32_t>(sim::Stream::inference), number,
                                           f.flapper + first + i, f.flight + first + i)
                            .u[0]
                            .raw[0];
        const auto count = static_cast<std::uint32_t>(share * static_cast<T>(most + 1));
        return count < most ? count : most;
      };
      const std::uint32_t most = plan.late_drawn ? at_most(plan.late_most, kOfFlight) : plan.late_most;
      periods[i] = static_cast<T>(at_most(most, f.tick[first + i]));
    }
    waits[i] = static_cast<T>(since) < periods[i] ? T(1) : T(0);
  }
  const auto waiting = L<T>::load(waits) > L<T>(0);
  for (int k = 0; k < kMaxActions; ++k) {
    T* const acting = s.late + k * kLanes<T> + first;
    episode.adds[k] = where(waiting, L<T>::load(acting), episode.adds[k]);
    episode.adds[k].store(acting);
  }
}

/// The inputs that the controller has learnt to hold; 0 without a controller.
template <class T>
FLAPPY_INLINE WingBeat<L<T>> learnt_trim(const FlightBlock<T>& f, const FlightPlan<T>& plan, int first) {
  WingBeat<L<T>> trim{L<T>(0), L<T>(0), L<T>(0), L<T>(0)};
  with_controller(plan.controller_kind, [&]<class C>(C) {
    trim = C::trim(plan.controller.template of<C>(), load_rows<typename C::template Memory<L<T>>>(f.controller, first));
  });
  return trim;
}

/// The policy's voltages, clipped to the motors' voltage limits.
template <class T>
FLAPPY_INLINE sim::Voltages<L<T>> commanded(const FlightSpace<T>& s, const Episode<L<T>>& episode, int first) {
  const auto& p = view_rows<Parameters<L<T>>>(s.body.parameters, first);
  const auto clip = [](const L<T>& voltage, const L<T>& limit) { return clamp(voltage, L<T>(-limit), limit); };
  return {clip(episode.adds[0], p.left.voltage_limit_V), clip(episode.adds[1], p.right.voltage_limit_V)};
}

template <class T>
FLAPPY_INLINE void steer(const FlightSpace<T>& s, const FlightPlan<T>& plan, int first) {
  FlightBlock<T>& f = s.flight;
  auto episode = load_rows<Episode<L<T>>>(f.episode, first);
  if (plan.actor.layers > 0) act(s, plan, episode, first);
  if (plan.late_most > 0) come_late(s, plan, episode, first);
  const auto estimate = load_rows<Estimate<L<T>>>(f.estimate, first);
  const auto ref = setpoint(f, plan, first);
  const L<T> zero(0);
  WingBeat<L<T>> base{zero, zero, zero, zero};
  with_controller(plan.controller_kind, [&]<class C>(C) {
    const auto& constants = plan.controller.template of<C>();
    const auto before = load_rows<typename C::template Memory<L<T>>>(f.controller, first);
    auto memory = before;
    base = C::update(constants, memory, estimate, ref);
    if (plan.task.holds_trim > 0) {
      const auto held = episode.handed_back <= zero;
      const WingBeat<L<T>> learnt = C::trim(constants, before);
      base = {where(held, learnt.amplitude_V, base.amplitude_V), where(held, learnt.difference_V, base.difference_V),
              where(held, learnt.bias_V, base.bias_V), where(held, learnt.split_cycle, base.split_cycle)};
      C::unlearn(held, before, memory);
    }
    store_rows(memory, f.controller, first);
  });
  auto drive = load_rows<sim::Drive<L<T>>>(s.body.drive, first);
  if (plan.sets_voltages) drive.voltages = commanded(s, episode, first);
  else drive.input = add_action(episode, base);
  if (plan.task.hand_back.rests > 0) {
    const auto rests = episode.handed_back > zero;
    drive.input = {where(rests, zero, drive.input.amplitude_V), where(rests, zero, drive.input.difference_V),
                   where(rests, zero, drive.input.bias_V), where(rests, zero, drive.input.split_cycle)};
  }
  std::uint32_t any_status = 0;
  for (int i = 0; i < kWidth<T>; ++i) any_status |= s.body.status[first + i];
  if (__builtin_expect(plan.sets_voltages || (any_status & sim::kDirect) != 0, 0))
    for (int i = 0; i < kWidth<T>; ++i) {
      std::uint32_t& status = s.body.status[first + i];
      status = plan.sets_voltages ? status | sim::kDirect : status & ~sim::kDirect;
    }
  store_rows(drive, s.body.drive, first);
}

/// Stores the true motion at the end of a slice, for sensors and reward.
template <class T>
FLAPPY_INLINE void look(const FlightSpace<T>& s, int first) {
  const auto truth =
      truth_of(view_rows<Parameters<L<T>>>(s.body.parameters, first), view_rows<State<L<T>>>(s.body.state, first));
  store_rows(truth, s.flight.truth, first);
}

/// Time since the start of each lane's flight, at physics step `steps` of the control period.
template <class T>
FLAPPY_INLINE L<T> flight_time_s(const FlightBlock<T>& f, const FlightPlan<T>& plan, std::int64_t steps, int first) {
  T time[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i)
    time[i] = static_cast<T>(f.tick[first + i] * static_cast<double>(plan.task.tick_s) +
                             static_cast<double>(steps) * plan.physics->step_s);
  return L<T>::load(time);
}

template <class T>
FLAPPY_INLINE L<T> beat_phase(const sim::Block<T>& body, int first) {
  T fraction[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i) fraction[i] = beat_fraction<T>(body.phase[first + i]);
  return L<T>::load(fraction);
}

/// Mocap sample number `index` of a true motion, with noise and sensor effects. `seen`: 0 where the sample is lost.
template <class T>
FLAPPY_INLINE MocapSample<L<T>> see(const FlightSpace<T>& s, const FlightPlan<T>& plan, const Truth<L<T>>& truth,
                                    const L<T>& seen, std::uint32_t index, int first) {
  const auto noise = [&](std::uint32_t k) {
    return sim::normals<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::mocap), 3 * index + k,
                              s.flight.flapper + first, s.flight.flight + first);
  };
  auto sample = sample_mocap(plan.mocap, truth, seen, noise(0), noise(1));
  if (s.effects.set & kMocapEffects) disturb(s.effects, truth.attitude, sample, first);
  return sample;
}

/// Whether poses of any lane are later than by the latency.
template <class T>
FLAPPY_INLINE bool shows_the_past(const FlightSpace<T>& s, const FlightPlan<T>& plan) {
  return (s.effects.set & kBit<MocapDelay>) != 0 || plan.mocap.jitter_s > 0;
}

/// For lanes with mocap_delay or jitter: replaces the pose of a correction by one of the true motion at sample time less both.
/// It runs when the pose arrives, because a negative delay needs motion after the sample time.
template <class T>
FLAPPY_INLINE void delay(const FlightSpace<T>& s, const FlightPlan<T>& plan, const Correction& correction, int first) {
  T* rows = s.queue + static_cast<std::ptrdiff_t>(correction.slot) * kMocapRows * kLanes<T>;
  const auto pose = load_rows<MocapSample<L<T>>>(slot(s.queue, correction.slot, kMocapRows), first);
  L<T> late = effect_parameter<MocapDelay>(s.effects, 0, first);
  if (plan.mocap.jitter_s > 0) {
    const auto draw = [&](std::uint32_t number) {
      return sim::uniforms<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::mocap), number,
                                 s.flight.flapper + first, s.flight.flight + first)
          .u[1];
    };
    const L<T> sample = jitter_of(plan.mocap, draw(3 * correction.index + 2));
    late += plan.mocap.drawn > 0 ? L<T>(sample * draw(kOfFlight)) : sample;
  }
  const L<T> age = L<T>(L<T>(correction.age_s) + late) / L<T>(plan.task.tick_s);
  const auto truth = load_rows<Truth<L<T>>>(s.flight.truth, first);
  const auto past = past_truth<T>(s.effects, s.flight.tick + first, truth, age, plan.task.tick_s, first);
  const auto then = see(s, plan, past, pose.valid, correction.index, first);
  const L<T>*from = reinterpret_cast<const L<T>*>(&then), *prompt = reinterpret_cast<const L<T>*>(&pose);
  for (int r = 0; r < kMocapRows; ++r) where(late == L<T>(0), prompt[r], from[r]).store(rows + r * kLanes<T> + first);
}

/// Takes the samples that are due at the end of a slice, at physics step `steps` of the control period.
template <class T>
FLAPPY_INLINE void sense(const FlightSpace<T>& s, const FlightPlan<T>& plan, const Slice& slice, std::int64_t steps,
                         int imu_samples, int mocap_samples, int first) {
  FlightBlock<T>& f = s.flight;
  const auto truth = load_rows<Truth<L<T>>>(f.truth, first);
  if (slice.imu) {
    const auto noise = [&](std::uint32_t k) {
      return sim::normals<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::imu), 2 * slice.imu_index + k,
                                f.flapper + first, f.flight + first);
    };
    auto imu = load_rows<Imu<L<T>>>(f.imu, first);
    const L<T> interval(slice.imu_interval_s);
    auto sample = sample_imu(plan.imu, L<T>(L<T>(1) / interval), truth, imu, noise(0), noise(1));
    store_rows(imu, f.imu, first);
    if (s.effects.set & kImuEffects)
      disturb(s.effects, flight_time_s(f, plan, steps, first), beat_phase(s.body, first), imu.low_passed.accel_m_s2,
              sample, first);
    auto estimator = load_rows<Estimator<L<T>>>(f.estimator, first);
    gather(estimator.gathered, sample, interval);
    store_rows(estimator, f.estimator, first);
    if (s.tap.imu != nullptr) store_rows(sample, slot(s.tap.imu, imu_samples, kImuSampleRows), first);
  }
  if (slice.mocap) {
    L<T> seen = L<T>::load(f.seen[0] + first), chance(1);
    if (plan.losses)
      chance = sim::uniforms<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::mocap), 3 * slice.mocap_index + 2,
                                   f.flapper + first, f.flight + first)
                   .u[0];
    seen = next_seen(plan.mocap, seen, chance);
    const auto sample = see(s, plan, truth, seen, slice.mocap_index, first);
    seen.store(f.seen[0] + first);
    store_rows(sample, slot(s.queue, slice.mocap_slot, kMocapRows), first);
    if (s.tap.mocap != nullptr) store_rows(sample, slot(s.tap.mocap, mocap_samples, kMocapRows), first);
  }
}

template <class T>
FLAPPY_INLINE void estimate(const FlightSpace<T>& s, const FlightPlan<T>& plan, int first) {
  FlightBlock<T>& f = s.flight;
  auto estimator = load_rows<Estimator<L<T>>>(f.estimator, first);
  const L<T> zero(0), gravity(plan.estimator.gravity_m_s2);
  const auto increment = [&](int index) {
    return load_rows<Increment<L<T>>>(slot(s.ring, index, kIncrementRows), first);
  };
  const auto move = [&](Pose<L<T>>& pose, const Advance& a) {
    advance(pose, increment(a.slot), estimator.gyro_bias_rad_s, estimator.accel_bias_m_s2, L<T>(a.share),
            L<T>(a.duration_s), gravity);
  };
  if (plan.push_slot >= 0) {
    store_rows(estimator.gathered, slot(s.ring, plan.push_slot, kIncrementRows), first);
    estimator.gathered = {{zero, zero, zero}, {zero, zero, zero}};
  }
  for (int i = 0; i < plan.correction_count; ++i) {
    const Correction& pose = plan.corrections[i];
    for (const Advance* a = plan.advance + pose.first; a != plan.advance + pose.first + pose.count; ++a) {
      move(estimator.horizon, *a);
      spread(estimator.covariance, plan.estimator, L<T>(a->share * a->duration_s));
    }
    if (shows_the_past(s, plan)) delay(s, plan, pose, first);
    correct(estimator, plan.estimator, load_rows<MocapSample<L<T>>>(slot(s.queue, pose.slot, kMocapRows), first));
  }
  if (plan.correction_count > 0) estimator.now = estimator.horizon;
  for (int i = 0; i < plan.replay_count; ++i) move(estimator.now, plan.replay[i]);

  Pose<L<T>> ahead = estimator.now;
  if (plan.newest.slot >= 0) {
    const L<T> per_duration(1 / plan.newest.duration_s);
    estimator.body_rate_rad_s = per_duration * increment(plan.newest.slot).rotation_rad - estimator.gyro_bias_rad_s;
    if (plan.ahead_s > 0)
      move(ahead, {plan.newest.slot, plan.ahead_s / plan.newest.duration_s, plan.newest.duration_s});
  }
  store_rows(torso(plan.estimator, ahead, estimator.body_rate_rad_s), f.estimate, first);
  store_rows(estimator, f.estimator, first);
}

/// Computes the reward, checks whether the episode ends, and writes the next observation.
template <class T>
FLAPPY_INLINE void reward_and_terminate(const FlightSpace<T>& s, const FlightPlan<T>& plan, int first) {
  FlightBlock<T>& f = s.flight;
  const auto truth = load_rows<Truth<L<T>>>(f.truth, first);
  auto episode = load_rows<Episode<L<T>>>(f.episode, first);
  T time[kWidth<T>], touching[kWidth<T>];
  for (int i = 0; i < kWidth<T>; ++i) {
    time[i] = static_cast<T>(++f.tick[first + i]) * plan.task.tick_s;
    touching[i] = (s.body.status[first + i] & sim::kTouching) != 0 ? T(1) : T(0);
  }
  const auto ref = setpoint(f, plan, first);
  const auto score = score_of(truth, ref);
  const L<T> now = L<T>::load(time), touches = L<T>::load(touching);
  const auto estimate = load_rows<Estimate<L<T>>>(f.estimate, first);
  const bool by_estimate = plan.task.hand_back.on_estimate > 0;
  const auto done = by_estimate
                        ? arrived(plan.task.hand_back, score_of(estimate, ref), estimate.body_rate_rad_s, now, touches)
                        : arrived(plan.task.hand_back, score, truth.body_rate_rad_s, now, touches);
  note_success(plan.task.success, score, truth.body_rate_rad_s, now, episode, touches);
  episode.reward = reward_of(plan.task.reward, score, truth, now, L<T>(plan.task.tick_s), done, episode);
  episode.action_reward += episode.reward;
  episode.handed_back = where(done, L<T>(1), episode.handed_back);
  for (int i = 0; i < kMaxActions; ++i) episode.previous[i] = episode.action[i];

  check_termination(plan.task.limits, score, now, [&](typename L<T>::Mask mask, std::uint32_t bit) {
    if (!rarely(mask)) return;
    for (int i = 0; i < kWidth<T>; ++i)
      if (mask.raw[i]) f.ended[first + i] |= bit;
  });
  for (int i = 0; i < kWidth<T>; ++i) {
    const std::uint32_t status = s.body.status[first + i];
    if (status & sim::kFrozen) f.ended[first + i] |= kNotFinite;
    if (plan.task.contact_ends > 0 && (status & ~(std::uint32_t{sim::kFrozen} | sim::kTouching | sim::kDirect)))
      f.ended[first + i] |= kContact;
  }
  L<T> row[kMaxObservation];
  const int rows = observe(plan.parts, plan.actions, estimate, ref, episode, beat_phase(s.body, first), now,
                           learnt_trim(f, plan, first), wings_of(view_rows<State<L<T>>>(s.body.state, first)), row);
  for (int i = 0; i < rows; ++i) row[i].store(f.observation[i] + first);
  store_rows(episode, f.episode, first);
}

/// The processor's time-stamp counter; ticks of the steady clock on other architectures than x86-64.
std::uint64_t cycles_now() {
#if defined(__x86_64__)
  return __rdtsc();
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

/// Adds the time since the last lap to a stage; does nothing if `cycles` is null.
class Stopwatch {
 public:
  explicit Stopwatch(std::uint64_t* cycles) : cycles_(cycles), last_(cycles != nullptr ? cycles_now() : 0) {}
  void lap(Stage stage) {
    if (cycles_ == nullptr) return;
    const std::uint64_t now = cycles_now();
    cycles_[stage] += now - last_;
    last_ = now;
  }

 private:
  std::uint64_t* cycles_;
  std::uint64_t last_;
};

template <class T>
void fly_block(const FlightSpace<T>& s, const FlightPlan<T>& plan) {
  Stopwatch watch(plan.cycles);
  if (shows_the_past(s, plan))
    for_lanes<T>([&](int first) {
      keep_past(s.effects, s.flight.tick + first, load_rows<Truth<L<T>>>(s.flight.truth, first),
                plan.mocap.jitter_s > 0, first);
    });
  for_lanes<T>([&](int first) { steer(s, plan, first); });
  watch.lap(kSteer);
  std::int64_t step = plan.first_step;
  int imu_samples = 0, mocap_samples = 0;
  for (int i = 0; i < plan.slice_count; ++i) {
    const Slice& slice = plan.slices[i];
    plan.step(s.body, s.effects, *plan.physics, step, slice.steps, i == 0 ? s.ahead : sim::Ahead{});
    watch.lap(kPhysics);
    step += slice.steps;
    const bool sampled = slice.imu || slice.mocap, last = i + 1 == plan.slice_count;
    if (sampled || last) for_lanes<T>([&](int first) { look(s, first); });
    if (sampled)
      for_lanes<T>(
          [&](int first) { sense(s, plan, slice, step - plan.first_step, imu_samples, mocap_samples, first); });
    imu_samples += slice.imu;
    mocap_samples += slice.mocap;
    watch.lap(kSense);
  }
  for_lanes<T>([&](int first) { estimate(s, plan, first); });
  watch.lap(kEstimate);
  for_lanes<T>([&](int first) { reward_and_terminate(s, plan, first); });
  watch.lap(kReward);
}

}  // namespace

extern const FlyBlock<float> fly_float;
extern const FlyBlock<double> fly_double;
const FlyBlock<float> fly_float = fly_block<float>;
const FlyBlock<double> fly_double = fly_block<double>;

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
