#pragma once

#include <algorithm>
#include <cmath>

#include "flight/constants.hpp"
#include "flight/flight_block.hpp"
#include "sim/storage.hpp"

namespace flappy::flight {

using model::Quaternion;
using model::Vec3;
using sim::get;
using sim::put;
using One = model::Lanes<double, 1>;

/// Floating-point rows of sim::Block and of FlightBlock; the integer members that follow are not counted.
inline constexpr int kBodyRows = sim::kParameterRows + sim::kStateRows + sim::kDriveRows;
template <class T>
inline constexpr int kFlightRows = offsetof(FlightBlock<T>, flapper) / sizeof(T[kLanes<T>]);

template <class T, class B>
auto rows_of(B& block) {
  return reinterpret_cast<std::conditional_t<std::is_const_v<B>, const T, T>(*)[kLanes<T>]>(&block);
}

inline double square(double x) { return x * x; }

template <class T>
struct Fleet<T>::Storage {
  FleetOptions options;
  sim::Batch<T> batch;
  Schedule schedule;
  FlightPlan<T> plan{};
  sim::StepPlan physics{};
  FlyBlock<T> fly;
  int period_steps;
  std::vector<FlightBlock<T>> blocks;
  std::vector<T> ring, queue;  // [block][slot][row][lane]
  std::vector<T> remembered;   // earlier observations: [block][action ago][row of the observation][lane]
  std::vector<T> late;         // [block]: FlightSpace::late
  std::vector<T> recalled;     // [block]: FlightSpace::memory
  std::size_t ring_size, queue_size, past_size, late_size, recalled_size = 0;
  std::vector<Segment<T>> path;
  std::shared_ptr<const policy::Actor> actor;
  std::vector<T> actor_numbers;
  std::vector<Period> periods;       // control periods that are flown now, or were flown last
  std::vector<FlightPlan<T>> plans;  // one for each of `periods`
  std::vector<T> imu_tap, mocap_tap;
  std::size_t imu_tap_size = 0, mocap_tap_size = 0;
  bool recording = false;

  Storage(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& o, int steps, FlyBlock<T> loop)
      : options(o),
        batch(count, vehicle, o.batch),
        schedule(o.sensors, o.batch.step_s, steps),
        fly(loop),
        period_steps(steps) {
    const std::size_t n = sim::storage_of(batch).blocks.size();
    blocks.resize(n);
    ring_size = static_cast<std::size_t>(schedule.ring_slots()) * kIncrementRows * kLanes<T>;
    queue_size = static_cast<std::size_t>(schedule.queue_slots()) * kMocapRows * kLanes<T>;
    ring.assign(n * ring_size, T(0));
    check_delay(vehicle);
    if (o.sensors.mocap.jitter_s > 0)
      sim::storage_of(batch).keep_effects(std::uint64_t{1} << model::effect_index(model::MocapDelay::kInfo.id));
    queue.assign(n * queue_size, T(0));
    for (const Segment<double>& s : o.task.path) {
      Segment<T> to{s.start_tick, {}};
      for (int c = 0; c < 4; ++c)
        for (int k = 0; k < 6; ++k) to.coefficients[c][k] = static_cast<T>(s.coefficients[c][k]);
      path.push_back(to);
    }
    fill_plan();
    past_size = static_cast<std::size_t>(plan.past) * kLanes<T>;
    remembered.assign(n * past_size, T(0));
    late_size = plan.late_most > 0 ? kLateRows * kLanes<T> : 0;
    late.assign(n * late_size, T(0));
  }

  void fill_plan() {
    const FlightConstants k = flight_constants(options);
    plan.step = sim::storage_of(batch).kernel;
    plan.seed = options.seed;
    plan.first_flapper = options.first_flapper;
    plan.losses = k.mocap.loss_begins > 0;
    plan.imu = rounded<T>(k.imu);
    plan.mocap = rounded<T>(k.mocap);
    plan.estimator = rounded<T>(k.estimator);
    plan.controller_kind = options.controller.kind;
    plan.controller = rounded<T>(k.controller);
    plan.task = rounded<T>(k.task);
    plan.parts = options.task.parts;
    plan.actions = options.task.actions();
    plan.sets_voltages = options.task.sets_voltages();
    plan.action_repeat = options.task.action_repeat;
    plan.late_most = options.task.action_late_most;
    plan.late_drawn = options.task.action_late_drawn;
    const auto all = static_cast<int>(options.task.observation().size());
    plan.observed = all / static_cast<int>(options.task.history);
    plan.past = all - plan.observed;
    plan.path = {path.data(), static_cast<std::uint32_t>(path.size()), static_cast<T>(k.period_s)};
  }

  /// Throws std::invalid_argument if mocap_delay would make a pose precede its motion or outlast the motion memory.
  void check_delay(const model::Vehicle& v) const {
    const double period_s = period_steps * options.batch.step_s, jitter_s = options.sensors.mocap.longest_jitter_s();
    const double remembered_s = (model::MocapDelay::kSlots - 1) * period_s;
    if (jitter_s > 0 && schedule.longest_wait_s() + jitter_s > remembered_s)
      throw std::invalid_argument("jitter of motion capture: poses up to " + std::to_string(jitter_s) +
                                  " s late are more than " + std::to_string(model::MocapDelay::kSlots) +
                                  " control periods remember; accepted: less, a lower mocap.latency_s or control rate");
    const auto own = v.effects.find(model::MocapDelay::kInfo.id);
    if (own == v.effects.end()) return;
    const auto index = static_cast<std::size_t>(model::effect_index(model::MocapDelay::kInfo.id));
    const double delay_s = model::effects()[index].values(own->second)[0], latency_s = options.sensors.mocap.latency_s;
    if (delay_s < -latency_s)
      throw std::invalid_argument("effects.mocap_delay.delay_s: " + std::to_string(delay_s) +
                                  " is before the pose was; accepted: down to -mocap.latency_s, " +
                                  std::to_string(-latency_s));
    if (schedule.longest_wait_s() + jitter_s + delay_s > remembered_s)
      throw std::invalid_argument("effects.mocap_delay.delay_s: " + std::to_string(delay_s) + " is more than " +
                                  std::to_string(model::MocapDelay::kSlots) +
                                  " control periods remember; accepted: less, a lower mocap.latency_s or control rate");
  }

  void point_to_actor() {
    plan.actor = {};
    if (!actor) return;
    const T *weights = actor_numbers.data(), *mean = weights + actor->weights.size();
    plan.actor = policy::view_of(*actor, weights, mean, mean + actor->mean.size());
  }

  struct Place {
    FlightBlock<T>& block;
    int lane;
  };
  Place at(std::size_t i) {
    const auto place = sim::storage_of(batch).at(i);
    return {blocks[i / kLanes<T>], place.lane};
  }

  /// Element `k` of the earlier observations of flapper `i`, newest observation first.
  T* past_at(std::size_t i, int k) { return number_at(remembered, past_size, i, k); }
  /// Row `k` of flapper `i` in a list [block][row][lane]; `size`: numbers of a block.
  static T* number_at(std::vector<T>& list, std::size_t size, std::size_t i, int k) {
    return &list[i / kLanes<T> * size + static_cast<std::size_t>(k) * kLanes<T> + i % kLanes<T>];
  }
  /// Pushes the observation of flapper `i` into its history, as each action of a policy does.
  void remember(std::size_t i) {
    const auto [f, lane] = at(i);
    for (int k = plan.past - 1; k >= 0; --k)
      *past_at(i, k) = k < plan.observed ? f.observation[k][lane] : *past_at(i, k - plan.observed);
  }

  Setpoint<double> setpoint(FlightBlock<T>& f, int lane) const {
    const std::vector<Segment<double>>& p = options.task.path;
    const PathView<double> view{p.data(), static_cast<std::uint32_t>(p.size()), period_steps * options.batch.step_s};
    std::uint32_t segment = f.segment[lane];
    const Setpoint<One> s = setpoint_at<One>(view, &f.tick[lane], &segment);
    Setpoint<double> out;
    for (std::size_t k = 0; k < sizeof out / sizeof(double); ++k)
      reinterpret_cast<double*>(&out)[k] = reinterpret_cast<const One*>(&s)[k].raw[0];
    return out;
  }

  void check_count(std::size_t count) const {
    if (count != static_cast<std::size_t>(plan.actions))
      throw std::invalid_argument("an action of " + std::to_string(count) + " numbers where the task has " +
                                  std::to_string(plan.actions));
  }

  /// scaled_action() for one element, in the arithmetic of the lanes, so that the bits agree.
  T scaled(int k, T action) const {
    using L = model::Lanes<T, 1>;
    return L(scaled_action(plan.task, k, L(action))).raw[0];
  }

  /// Calls `change(controller type, memory)` and stores the memory. Does nothing without a controller.
  void change_controller(std::size_t i, const auto& change) {
    const auto [f, lane] = at(i);
    with_controller(options.controller.kind, [&, &f = f, lane = lane]<class C>(C table) {
      auto memory = get<typename C::template Memory<double>>(f.controller, lane);
      change(table, memory);
      put(memory, f.controller, lane);
    });
  }

  /// Calls `add(sample time, sample)` for each sample of flapper `i` in the tap. `taken`: the flag of slices that took
  /// a sample. Throws std::out_of_range.
  template <template <class> class Sample>
  void for_samples(std::size_t i, const std::vector<T>& tap, std::size_t tap_size, bool Slice::*taken,
                   const auto& add) const {
    if (tap.empty()) return;
    if (i >= batch.size()) throw std::out_of_range("no flapper " + std::to_string(i) + " in the fleet");
    const auto* rows = reinterpret_cast<const T(*)[kLanes<T>]>(&tap[i / kLanes<T> * tap_size]);
    const Period& period = periods.back();
    double time_s = static_cast<double>(period.first_step) * options.batch.step_s;
    for (const Slice& slice : period.slices) {
      time_s += slice.steps * options.batch.step_s;
      if (!(slice.*taken)) continue;
      add(time_s, get<Sample<double>>(rows, static_cast<int>(i % kLanes<T>)));
      rows += model::kRows<Sample>;
    }
  }

  void start(std::size_t i, std::uint32_t episode, const sim::FlapperState& state, sim::Start kind);
  void start(std::size_t i, std::uint32_t episode, const Snapshot<T>& snapshot);
  Snapshot<T> snapshot(std::size_t i, const Target& target);
  void start_lane(std::size_t i, std::uint32_t episode, const Truth<double>& truth);
  void show(std::size_t i);
  void observe_lane(std::size_t i, T* row);
  void start_estimator(std::size_t i, const Truth<double>& truth, sim::RandomKey key);
};

/// The part that all starts share: random-number keys, sensors, estimator, episode.
template <class T>
void Fleet<T>::Storage::start_lane(std::size_t i, std::uint32_t episode, const Truth<double>& truth) {
  const auto [f, lane] = at(i);
  f.flapper[lane] = options.first_flapper + static_cast<std::uint32_t>(i);
  f.flight[lane] = episode;
  f.tick[lane] = f.segment[lane] = f.ended[lane] = 0;
  put(truth, f.truth, lane);
  f.seen[0][lane] = 1;
  const sim::RandomKey key{options.seed, f.flapper[lane], episode, sim::Stream::sensor_bias};
  const auto& sd = options.sensors.imu.gyro_bias_sd_rad_s;
  Imu<double> imu{};
  imu.attitude = truth.attitude;
  const auto& at_m = options.sensors.imu.position_m;
  imu.velocity_m_s = point_velocity(truth, {at_m.x, at_m.y, at_m.z});
  imu.low_passed = {truth.body_rate_rad_s, transpose_times(rotation_matrix(truth.attitude),
                                                           Vec3<double>{0, 0, options.batch.world.gravity_m_s2})};
  imu.gyro_bias_rad_s = {sd.x * sim::normal(key, 0), sd.y * sim::normal(key, 1), sd.z * sim::normal(key, 2)};
  put(imu, f.imu, lane);
  start_estimator(i, truth, key);
  Episode<double> fresh{};
  for (int k = 0; k < plan.actions; ++k) fresh.adds[k] = scaled(k, 0);
  put(fresh, f.episode, lane);
  for (std::size_t k = static_cast<std::size_t>(lane); k < recalled_size; k += kLanes<T>)
    recalled[i / kLanes<T> * recalled_size + k] = T(0);
  if (late_size > 0)
    for (int k = 0; k < kMaxActions; ++k) *number_at(late, late_size, i, k) = static_cast<T>(fresh.adds[k]);
}

/// Computes the observation before the first control period, and fills the history with it.
template <class T>
void Fleet<T>::Storage::show(std::size_t i) {
  const auto [f, lane] = at(i);
  T row[kMaxObservation] = {};
  observe_lane(i, row);
  for (int k = 0; k < kMaxObservation; ++k) f.observation[k][lane] = row[k];
  for (int k = 0; k < plan.past; ++k) *past_at(i, k) = row[k % plan.observed];
}

/// Computes the observation of one flapper in the arithmetic of the lanes, so that the bits agree.
template <class T>
void Fleet<T>::Storage::observe_lane(std::size_t i, T* row) {
  using L = model::Lanes<T, 1>;
  const auto [f, lane] = at(i);
  const auto x = get<Estimate<double>>(f.estimate, lane);
  WingBeat<L> learnt{L(0), L(0), L(0), L(0)};
  change_controller(
      i, [&]<class C>(C, auto& memory) { learnt = C::trim(plan.controller.template of<C>(), rounded<L>(memory)); });
  std::uint32_t segment = f.segment[lane];
  const auto ref = setpoint_at<L>(plan.path, &f.tick[lane], &segment);
  const sim::Block<T>& body = sim::storage_of(batch).at(i).block;
  const T fraction = model::beat_fraction<T>(body.phase[lane]);
  const T time = static_cast<T>(f.tick[lane]) * plan.task.tick_s;
  L seen[kMaxObservation];
  const auto wings = wings_of(rounded<L>(get<State<double>>(body.state, lane)));
  const int rows =
      observe(plan.parts, plan.actions, rounded<L>(x), ref, rounded<L>(get<Episode<double>>(f.episode, lane)),
              L::load(&fraction), L::load(&time), learnt, wings, seen);
  for (int k = 0; k < rows; ++k) row[k] = seen[k].raw[0];
}

template <class T>
void Fleet<T>::Storage::start(std::size_t i, std::uint32_t episode, const sim::FlapperState& s, sim::Start kind) {
  batch.reset(i, s, kind);
  start_lane(i, episode,
             {{s.position_m[0], s.position_m[1], s.position_m[2]},
              {s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]},
              {s.velocity_m_s[0], s.velocity_m_s[1], s.velocity_m_s[2]},
              {s.body_rate_rad_s[0], s.body_rate_rad_s[1], s.body_rate_rad_s[2]}});
  const auto [f, lane] = at(i);
  const auto x = get<Estimate<double>>(f.estimate, lane);
  for (auto& row : f.controller) row[lane] = 0;
  change_controller(i, [&]<class C>(C, auto& memory) { C::start(memory, x); });
  show(i);
}

template <class T>
Snapshot<T> Fleet<T>::Storage::snapshot(std::size_t i, const Target& target) {
  auto& body = sim::storage_of(batch);
  const auto [block, lane] = body.at(i);
  const FlightBlock<T>& f = at(i).block;
  Snapshot<T> s{{}, {}, 0, {}, {}, {}, {}, {}, block.phase[lane], block.phase_per_update[lane], target};
  s.effects = body.get_effects(i, s.effect_rows, s.effect_states);
  s.motors = body.get_motors(i);
  s.own = body.jointed ? body.get_jointed(i) : body.get_beat_averaged(i);
  s.contact = body.get_contact(i);
  for (int r = 0; r < kBodyRows; ++r) s.body.push_back(rows_of<T>(block)[r][lane]);
  for (int r = 0; r < kFlightRows<T>; ++r) s.flight.push_back(rows_of<T>(f)[r][lane]);
  return s;
}

template <class T>
void Fleet<T>::Storage::start(std::size_t i, std::uint32_t episode, const Snapshot<T>& s) {
  const auto [block, lane] = sim::storage_of(batch).at(i);
  FlightBlock<T>& f = at(i).block;
  for (int r = 0; r < kBodyRows; ++r) rows_of<T>(block)[r][lane] = s.body[static_cast<std::size_t>(r)];
  for (int r = 0; r < kFlightRows<T>; ++r) rows_of<T>(f)[r][lane] = s.flight[static_cast<std::size_t>(r)];
  sim::storage_of(batch).put_effects(i, s.effects, s.effect_rows, s.effect_states);
  sim::storage_of(batch).put_motors(i, s.motors);
  sim::storage_of(batch).put_beat_averaged(i, s.own.first, s.own.second);
  sim::storage_of(batch).put_jointed(i, s.own.first, s.own.second);
  sim::storage_of(batch).clear_energy(i);
  block.phase[lane] = s.phase;
  block.phase_per_update[lane] = s.phase_per_update;
  block.status[lane] = 0;

  // the rigid motion from the snapshot's set point to the start of this episode
  const std::uint32_t flapper = options.first_flapper + static_cast<std::uint32_t>(i);
  const sim::FlapperState to = options.task.sample_start({options.seed, flapper, episode, sim::Stream::start});
  const auto now =
      heading_of(rotation_matrix(Quaternion<double>{to.attitude[0], to.attitude[1], to.attitude[2], to.attitude[3]}));
  const SinCos<double> turn{now.sin * s.target.heading_cos - now.cos * s.target.heading_sin,
                            now.cos * s.target.heading_cos + now.sin * s.target.heading_sin};
  const double half = atan2(turn.sin, turn.cos) / 2;
  const SinCos<double> h = sin_cos_wide(half);
  const auto rotated_z = [&](const Vec3<double>& v) { return rotate_z(turn.sin, turn.cos, v); };
  const auto rotated_q = [&](const Quaternion<double>& q) {
    return Quaternion<double>{h.cos * q.w - h.sin * q.z, h.cos * q.x - h.sin * q.y, h.cos * q.y + h.sin * q.x,
                              h.cos * q.z + h.sin * q.w};
  };
  const Vec3<double> from{s.target.position_m[0], s.target.position_m[1], s.target.position_m[2]};
  const Vec3<double> at_m{to.position_m[0], to.position_m[1], to.position_m[2]};
  auto x = get<State<double>>(block.state, lane);
  x.position_m = at_m + rotated_z(x.position_m - from);
  x.attitude = rotated_q(x.attitude);
  x.com_velocity_m_s = rotated_z(x.com_velocity_m_s);
  put(x, block.state, lane);
  if (T* const weight = sim::storage_of(batch).hanging_weight(i)) {  // on its line it moves too
    constexpr std::size_t kNext = kLanes<T>;
    const Vec3<double> hangs = at_m + rotated_z(Vec3<double>{weight[0], weight[kNext], 0} - from);
    const Vec3<double> swings = rotated_z(Vec3<double>{weight[2 * kNext], weight[3 * kNext], 0});
    weight[0] = static_cast<T>(hangs.x), weight[kNext] = static_cast<T>(hangs.y);
    weight[2 * kNext] = static_cast<T>(swings.x), weight[3 * kNext] = static_cast<T>(swings.y);
  }
  auto contact = s.contact;  // friction anchors are points in W: they move too
  for (std::size_t k = 0; k + 3 < contact.second.size(); k += 4) {
    T* const anchor = &contact.second[k];
    if (!(anchor[3] > 0)) continue;
    const Vec3<double> moved = at_m + rotated_z(Vec3<double>{anchor[0], anchor[1], anchor[2]} - from);
    anchor[0] = static_cast<T>(moved.x), anchor[1] = static_cast<T>(moved.y), anchor[2] = static_cast<T>(moved.z);
  }
  sim::storage_of(batch).put_contact(i, contact.first, contact.second);

  const auto imu = get<Imu<double>>(f.imu, lane);
  const auto learnt = get<Estimator<double>>(f.estimator, lane);
  const auto flown = get<Truth<double>>(f.truth, lane);
  start_lane(i, episode, {x.position_m, x.attitude, rotated_z(flown.velocity_m_s), flown.body_rate_rad_s});
  auto fresh_imu = get<Imu<double>>(f.imu, lane);
  fresh_imu.gyro_bias_rad_s = imu.gyro_bias_rad_s;
  fresh_imu.low_passed = imu.low_passed;
  put(fresh_imu, f.imu, lane);
  auto estimator = get<Estimator<double>>(f.estimator, lane);
  estimator.gyro_bias_rad_s = learnt.gyro_bias_rad_s;
  estimator.accel_bias_m_s2 = learnt.accel_bias_m_s2;
  estimator.covariance.gyro_bias = learnt.covariance.gyro_bias;
  estimator.covariance.accel_bias = learnt.covariance.accel_bias;
  put(estimator, f.estimator, lane);
  change_controller(i, [&]<class C>(C, auto& memory) { C::rotate(turn.sin, turn.cos, memory); });
  show(i);
}

/// Starts the estimator as if it had observed the flapper before its start, with the accuracy of one mocap pose: its
/// ring holds IMU increments of steady motion.
template <class T>
void Fleet<T>::Storage::start_estimator(std::size_t i, const Truth<double>& truth, sim::RandomKey key) {
  const auto [f, lane] = at(i);
  const Sensors& s = options.sensors;
  const auto noise = [&](double sd, std::uint32_t first) {
    return Vec3<double>{sd * sim::normal(key, first), sd * sim::normal(key, first + 1),
                        sd * sim::normal(key, first + 2)};
  };
  key.stream = sim::Stream::start_estimate;
  Estimate<double> x{truth.position_m + noise(s.mocap.position_noise_m, 0),
                     rotated(truth.attitude, noise(s.mocap.attitude_noise_rad / 2, 3)),
                     truth.velocity_m_s + noise(s.estimator.initial_velocity_sd_m_s, 6), truth.body_rate_rad_s};
  put(x, f.estimate, lane);

  const double gravity = options.batch.world.gravity_m_s2;
  Estimator<double> estimator{};
  EstimatorConstants<double> place{};
  place.imu_position_m[0] = s.imu.position_m.x;
  place.imu_position_m[1] = s.imu.position_m.y;
  place.imu_position_m[2] = s.imu.position_m.z;
  const Pose<double> imu = imu_pose(place, x);
  estimator.horizon = estimator.now = imu;
  estimator.horizon.position_m = add_scaled(imu.position_m, -schedule.horizon_age_s(), imu.velocity_m_s);
  estimator.now.position_m = add_scaled(imu.position_m, -schedule.present_age_s(), imu.velocity_m_s);
  estimator.body_rate_rad_s = x.body_rate_rad_s;
  estimator.covariance = start_covariance(s);
  put(estimator, f.estimator, lane);
  const Vec3<double> weight = transpose_times(rotation_matrix(x.attitude), Vec3<double>{0, 0, gravity});
  std::vector<Advance> past = schedule.pending();
  if (schedule.newest().slot >= 0) past.push_back(schedule.newest());
  for (const Advance& a : past) {
    T* rows = &ring[i / kLanes<T> * ring_size + static_cast<std::size_t>(a.slot * kIncrementRows * kLanes<T>)];
    put(Increment<double>{{0, 0, 0}, a.duration_s * weight}, reinterpret_cast<T(*)[kLanes<T>]>(rows), lane);
  }
  // poses sampled before the start belong to another flight
  for (int slot = 0; slot < schedule.queue_slots(); ++slot) {
    T* rows = &queue[i / kLanes<T> * queue_size + static_cast<std::size_t>(slot * kMocapRows * kLanes<T>)];
    put(MocapSample<double>{truth.position_m, truth.attitude, 0}, reinterpret_cast<T(*)[kLanes<T>]>(rows), lane);
  }
}

}  // namespace flappy::flight
