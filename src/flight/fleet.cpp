#include "flight/fleet.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "flight/fleet_storage.hpp"
#include "io/parallel.hpp"
#include "sim/kernels.hpp"

namespace flappy::flight {

FLAPPY_KERNELS(FlyBlock<float>, fly_float);
FLAPPY_KERNELS(FlyBlock<double>, fly_double);

namespace {

using model::Quaternion;

Motion motion(const Vec3<double>& p, const Quaternion<double>& q, const Vec3<double>& v, const Vec3<double>& w) {
  return {{p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}, {v.x, v.y, v.z}, {w.x, w.y, w.z}};
}

}  // namespace

template <class T>
Fleet<T>::Fleet(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& options) {
  const double steps = 1 / (options.control_hz * options.batch.step_s);
  if (!(steps >= 1) || std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("the control period is no whole number of physics steps");
  if (options.task.path.empty()) throw std::invalid_argument("the task has no path");
  if (options.task.sets_voltages() && options.controller.kind != kNoController)
    throw std::invalid_argument("a task of voltages has no controller");
  storage_ = std::make_unique<Storage>(count, vehicle, options, static_cast<int>(std::lround(steps)),
                                       sim::kernel_of<T>(fly_floats, fly_doubles, options.batch.instruction_set));
  // lanes beyond the last flapper fly a copy of it, so that every lane holds valid numbers
  Storage& s = *storage_;
  for (std::size_t i = 0; i < count; ++i) start(i, 0);
  for (std::size_t i = count; count > 0 && i < s.blocks.size() * kLanes<T>; ++i) {
    FlightBlock<T>& f = s.blocks.back();
    const int from = static_cast<int>((count - 1) % kLanes<T>), to = static_cast<int>(i % kLanes<T>);
    for (int r = 0; r < kFlightRows<T>; ++r) rows_of<T>(f)[r][to] = rows_of<T>(f)[r][from];
  }
}

template <class T>
Fleet<T>::~Fleet() = default;
template <class T>
Fleet<T>::Fleet(const Fleet& other) : storage_(std::make_unique<Storage>(*other.storage_)) {
  Storage& s = *storage_;  // its plan still points into the other's
  s.plan.path.segments = s.path.data();
  s.point_to_actor();
  s.plan.cycles = nullptr;
  s.plans.clear();
}
template <class T>
Fleet<T>::Fleet(Fleet&&) noexcept = default;
template <class T>
Fleet<T>& Fleet<T>::operator=(Fleet&&) noexcept = default;

template <class T>
std::size_t Fleet<T>::size() const {
  return storage_->batch.size();
}
template <class T>
const FleetOptions& Fleet<T>::options() const {
  return storage_->options;
}
template <class T>
sim::Batch<T>& Fleet<T>::batch() {
  return storage_->batch;
}
template <class T>
const sim::Batch<T>& Fleet<T>::batch() const {
  return storage_->batch;
}
template <class T>
double Fleet<T>::period_s() const {
  return storage_->period_steps * storage_->options.batch.step_s;
}

template <class T>
void Fleet<T>::set_vehicle(std::size_t i, const model::Vehicle& vehicle) {
  storage_->check_delay(vehicle);
  storage_->batch.set_vehicle(i, vehicle);
}

template <class T>
void Fleet<T>::start(std::size_t i, std::uint32_t episode) {
  const FleetOptions& o = storage_->options;
  const sim::RandomKey key{o.seed, o.first_flapper + static_cast<std::uint32_t>(i), episode, sim::Stream::start};
  start(i, episode, o.task.sample_start(key), o.task.start.kind);
}

template <class T>
void Fleet<T>::start(std::size_t i, std::uint32_t episode, const sim::FlapperState& state, sim::Start kind) {
  storage_->start(i, episode, state, kind);
}

template <class T>
void Fleet<T>::start(std::size_t i, std::uint32_t episode, const Snapshot<T>& snapshot) {
  storage_->start(i, episode, snapshot);
}

template <class T>
Snapshot<T> Fleet<T>::snapshot(std::size_t i) const {
  return storage_->snapshot(i, target(i));
}

template <class T>
void Fleet<T>::set_actor(const std::shared_ptr<const policy::Actor>& actor) {
  Storage& s = *storage_;
  if (actor) {
    const auto same = [](const std::vector<std::string>& names, const std::vector<Signal>& signals) {
      return std::ranges::equal(names, signals, {}, {}, &Signal::name);
    };
    if (!same(actor->observation, s.options.task.observation()) || !same(actor->action, s.options.task.action()) ||
        actor->widths.empty() || static_cast<std::size_t>(actor->widths.front()) != actor->observation.size())
      throw std::invalid_argument("the actor's observation or action is not that of the task");
  }
  s.actor = actor;
  s.actor_numbers.clear();
  if (actor)
    for (const std::vector<double>* list : {&actor->weights, &actor->mean, &actor->scale})
      for (const double x : *list) s.actor_numbers.push_back(static_cast<T>(x));
  s.point_to_actor();
  const std::size_t size = static_cast<std::size_t>(s.plan.actor.memory()) * kLanes<T>;
  if (size == s.recalled_size) return;  // an actor that learns goes on with what is remembered
  s.recalled_size = size;
  s.recalled.assign(s.blocks.size() * size, T(0));
}

template <class T>
void Fleet<T>::set_actions(std::size_t block, const T* actions) {
  const auto [first, last] = flappers(block);
  const auto count = static_cast<std::size_t>(storage_->plan.actions);
  auto& rows = storage_->blocks[block].episode;
  for (std::size_t k = 0; k < count; ++k) {
    T* const action = rows[offsetof(Episode<T>, action) / sizeof(T) + k];
    T* const adds = rows[offsetof(Episode<T>, adds) / sizeof(T) + k];
    for (std::size_t lane = 0; lane < last - first; ++lane) {
      action[lane] = actions[lane * count + k];
      adds[lane] = storage_->scaled(static_cast<int>(k), action[lane]);
    }
  }
  std::fill_n(rows[offsetof(Episode<T>, action_reward) / sizeof(T)], last - first, T(0));
  if (storage_->plan.past > 0)
    for (std::size_t i = first; i < last; ++i) storage_->remember(i);
}

template <class T>
Shown<T> Fleet<T>::shown(std::size_t block) const {
  const FlightBlock<T>& f = storage_->blocks[block];
  return {static_cast<std::size_t>(kLanes<T>),
          f.observation[0],
          f.episode[offsetof(Episode<T>, action_reward) / sizeof(T)],
          f.episode[offsetof(Episode<T>, handed_back) / sizeof(T)],
          f.ended,
          f.tick};
}

template <class T>
void Fleet<T>::set_adds(std::size_t i, std::span<const double> adds) {
  const auto [f, lane] = storage_->at(i);
  auto e = get<Episode<double>>(f.episode, lane);
  storage_->check_count(adds.size());
  for (std::size_t k = 0; k < adds.size(); ++k) {
    const double low = storage_->scaled(static_cast<int>(k), -1), high = storage_->scaled(static_cast<int>(k), 1);
    e.adds[k] = std::min(std::max(adds[k], low), high);
    e.action[k] = high > low ? 2 * (e.adds[k] - low) / (high - low) - 1 : 0;
  }
  put(e, f.episode, lane);
  storage_->remember(i);
}

template <class T>
void Fleet<T>::set_added(std::size_t i, const sim::Input& input) {
  const auto [f, lane] = storage_->at(i);
  auto e = get<Episode<double>>(f.episode, lane);
  const double added[kMaxActions] = {input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle};
  if (options().task.sets_voltages() && std::ranges::any_of(added, [](double x) { return x != 0; }))
    throw std::invalid_argument("a task of voltages has no inputs of the wing beat to add to");
  for (int k = 0; k < kMaxActions; ++k) e.added[k] = added[k];
  put(e, f.episode, lane);
}

template <class T>
void Fleet<T>::set_exploration(const Exploration& exploration) {
  Storage& s = *storage_;
  s.plan.explores = exploration.high > 0;
  s.plan.noise_kept = static_cast<T>(exploration.kept);
  s.plan.noise_fresh = static_cast<T>(std::sqrt(1 - square(exploration.kept)));
  const double more = size() > 1 ? (exploration.high - exploration.low) / static_cast<double>(size() - 1) : 0;
  s.plan.noise_low = static_cast<T>(exploration.low);
  s.plan.noise_more = static_cast<T>(more);
}

template <class T>
void Fleet<T>::begin(int periods) {
  Storage& s = *storage_;
  s.periods.resize(static_cast<std::size_t>(periods));
  s.plans.clear();
  s.physics = sim::storage_of(s.batch).plan();
  for (Period& period : s.periods) {
    period = s.schedule.next();
    FlightPlan<T> plan = s.plan;
    plan.physics = &s.physics;
    plan.period = static_cast<std::uint32_t>(period.first_step / s.period_steps);
    plan.first_step = period.first_step;
    plan.slices = period.slices.data();
    plan.slice_count = static_cast<int>(period.slices.size());
    plan.corrections = period.corrections.data();
    plan.correction_count = static_cast<int>(period.corrections.size());
    plan.advance = period.advance.data();
    plan.replay = period.replay.data();
    plan.replay_count = static_cast<int>(period.replay.size());
    plan.push_slot = period.push_slot;
    plan.newest = period.newest;
    plan.ahead_s = period.ahead_s;
    s.plans.push_back(plan);
  }
  if (s.recording) {
    s.imu_tap_size = s.periods.back().slices.size() * kImuSampleRows * kLanes<T>;
    s.mocap_tap_size = s.periods.back().slices.size() * kMocapRows * kLanes<T>;
    s.imu_tap.resize(s.blocks.size() * s.imu_tap_size);
    s.mocap_tap.resize(s.blocks.size() * s.mocap_tap_size);
  }
}

template <class T>
void Fleet<T>::fly_block(std::size_t b) {
  Storage& s = *storage_;
  auto& body = sim::storage_of(s.batch);
  for (const FlightPlan<T>& plan : s.plans) {
    const bool last = &plan == &s.plans.back();
    Tap<T> tap;
    if (s.recording && last) tap = {&s.imu_tap[b * s.imu_tap_size], &s.mocap_tap[b * s.mocap_tap_size]};
    sim::Ahead ahead;
    if (last && b + 1 < blocks())
      ahead = {{body.block_after(b),
                {&s.blocks[b + 1], sizeof s.blocks[b + 1]},
                {&s.ring[(b + 1) * s.ring_size], s.ring_size * sizeof(T)},
                {&s.queue[(b + 1) * s.queue_size], s.queue_size * sizeof(T)}}};
    s.fly({body.blocks[b], body.effects_of(b), s.blocks[b], &s.ring[b * s.ring_size], &s.queue[b * s.queue_size],
           s.remembered.data() + b * s.past_size, s.recalled.data() + b * s.recalled_size,
           s.late.data() + b * s.late_size, tap, ahead},
          plan);
  }
}

template <class T>
void Fleet<T>::end() {
  Storage& s = *storage_;
  sim::storage_of(s.batch).steps += static_cast<std::int64_t>(s.plans.size()) * s.period_steps;
}

template <class T>
void Fleet<T>::step() {
  begin(1);
  io::parallel_for(blocks(), sim::storage_of(storage_->batch).threads, [&](std::size_t b) { fly_block(b); });
  end();
}

template <class T>
std::size_t Fleet<T>::blocks() const {
  return storage_->blocks.size();
}

template <class T>
std::pair<std::size_t, std::size_t> Fleet<T>::flappers(std::size_t block) const {
  return {block * kLanes<T>, std::min(size(), (block + 1) * kLanes<T>)};
}

template <class T>
Motion Fleet<T>::truth(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto x = get<Truth<double>>(f.truth, lane);
  return motion(x.position_m, x.attitude, x.velocity_m_s, x.body_rate_rad_s);
}

template <class T>
Motion Fleet<T>::estimate(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto x = get<Estimate<double>>(f.estimate, lane);
  return motion(x.position_m, x.attitude, x.velocity_m_s, x.body_rate_rad_s);
}

template <class T>
Target Fleet<T>::target(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const Setpoint<double> s = storage_->setpoint(f, lane);
  return {{s.position_m.x, s.position_m.y, s.position_m.z},
          {s.velocity_m_s.x, s.velocity_m_s.y, s.velocity_m_s.z},
          {s.acceleration_m_s2.x, s.acceleration_m_s2.y, s.acceleration_m_s2.z},
          s.heading.cos,
          s.heading.sin,
          s.heading_rate_rad_s};
}

template <class T>
sim::Input Fleet<T>::input(std::size_t i) const {
  const auto [block, lane] = sim::storage_of(storage_->batch).at(i);
  const auto u = get<sim::Drive<double>>(block.drive, lane).input;
  return {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
}

template <class T>
double Fleet<T>::reward(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.episode[offsetof(Episode<T>, reward) / sizeof(T)][lane];
}
template <class T>
bool Fleet<T>::handed_back(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.episode[offsetof(Episode<T>, handed_back) / sizeof(T)][lane] > 0;
}
template <class T>
double Fleet<T>::captured_s(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.episode[offsetof(Episode<T>, captured_s) / sizeof(T)][lane];
}
template <class T>
double Fleet<T>::lost_s(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.episode[offsetof(Episode<T>, lost_s) / sizeof(T)][lane];
}
template <class T>
std::uint32_t Fleet<T>::ended(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.ended[lane];
}
template <class T>
std::uint32_t Fleet<T>::events(std::size_t i) const {
  const bool may_touch = !sim::storage_of(storage_->batch).points.empty() && storage_->plan.task.contact_ends <= 0;
  return storage_->batch.status(i) & (may_touch ? sim::kFrozen : ~std::uint32_t{sim::kTouching});
}
template <class T>
std::uint32_t Fleet<T>::tick(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.tick[lane];
}
template <class T>
std::vector<double> Fleet<T>::remembered(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  std::vector<double> all;
  const auto add = [&, lane = lane](const auto& rows, int count) {
    for (int r = 0; r < count; ++r) all.push_back(static_cast<double>(rows[r][lane]));
  };
  add(f.estimator, kEstimatorRows);
  add(f.estimate, kEstimateRows);
  const int kind = options().controller.kind;
  if (kind == kNoController) return all.push_back(0), all;  // C has no empty struct
  bool exported = false;
  with_controller(kind, [&]<class C>(C) {
    if constexpr (requires { C::kSource; }) exported = true, add(f.controller, model::kRows<C::template Memory>);
  });
  return exported ? all : std::vector<double>{};
}
template <class T>
std::vector<double> Fleet<T>::observation(std::size_t i) const {
  std::vector<T> row(static_cast<std::size_t>(storage_->plan.observed + storage_->plan.past));
  observation(i, row.data());
  return {row.begin(), row.end()};
}
template <class T>
void Fleet<T>::observation(std::size_t i, T* row) const {
  const auto [f, lane] = storage_->at(i);
  const FlightPlan<T>& plan = storage_->plan;
  for (int k = 0; k < plan.observed; ++k) row[k] = f.observation[k][lane];
  for (int k = 0; k < plan.past; ++k) row[plan.observed + k] = *storage_->past_at(i, k);
}
template <class T>
std::vector<T> Fleet<T>::actor_memory(std::size_t i) const {
  Storage& s = *storage_;
  std::vector<T> all;
  for (int k = 0; k < s.plan.actor.memory(); ++k) all.push_back(*Storage::number_at(s.recalled, s.recalled_size, i, k));
  return all;
}
template <class T>
std::array<T, kMaxActions> Fleet<T>::action(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  std::array<T, kMaxActions> action;
  for (int k = 0; k < kMaxActions; ++k) action[static_cast<std::size_t>(k)] = f.episode[k][lane];
  return action;
}
template <class T>
std::array<T, kMaxActions> Fleet<T>::adds(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  std::array<T, kMaxActions> adds;
  constexpr std::size_t kFirst = offsetof(Episode<T>, adds) / sizeof(T);
  for (std::size_t k = 0; k < kMaxActions; ++k) adds[k] = f.episode[kFirst + k][lane];
  return adds;
}
template <class T>
T Fleet<T>::action_reward(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.episode[offsetof(Episode<T>, action_reward) / sizeof(T)][lane];
}
template <class T>
std::pair<double, double> Fleet<T>::innovation(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto x = get<Estimator<double>>(f.estimator, lane);
  return {x.angle_innovation, x.position_innovation};
}

template <class T>
std::array<double, 3> Fleet<T>::gyro_bias_rad_s(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto bias = get<Imu<double>>(f.imu, lane).gyro_bias_rad_s;
  return {bias.x, bias.y, bias.z};
}

template <class T>
std::pair<std::array<double, 3>, std::array<double, 3>> Fleet<T>::felt(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto [gyro, accel] = get<Imu<double>>(f.imu, lane).low_passed;
  return {{gyro.x, gyro.y, gyro.z}, {accel.x, accel.y, accel.z}};
}

template <class T>
void Fleet<T>::count_cycles(std::uint64_t* cycles) {
  storage_->plan.cycles = cycles;
}

template <class T>
void Fleet<T>::record(bool on) {
  storage_->recording = on;
  storage_->imu_tap.clear();
  storage_->mocap_tap.clear();
}

template <class T>
auto Fleet<T>::imu_samples(std::size_t i) const -> std::vector<ImuRecord> {
  const Storage& s = *storage_;
  std::vector<ImuRecord> list;
  s.template for_samples<ImuSample>(i, s.imu_tap, s.imu_tap_size, &Slice::imu, [&](double time_s, const auto& x) {
    list.push_back({time_s + s.options.sensors.imu.latency_s,
                    {x.gyro_rad_s.x, x.gyro_rad_s.y, x.gyro_rad_s.z},
                    {x.accel_m_s2.x, x.accel_m_s2.y, x.accel_m_s2.z}});
  });
  return list;
}

template <class T>
auto Fleet<T>::mocap_samples(std::size_t i) const -> std::vector<MocapRecord> {
  const Storage& s = *storage_;
  std::vector<MocapRecord> list;
  const auto add = [&](double time_s, const MocapSample<double>& x) {
    list.push_back({time_s + s.options.sensors.mocap.latency_s,
                    {x.position_m.x, x.position_m.y, x.position_m.z},
                    {x.attitude.w, x.attitude.x, x.attitude.y, x.attitude.z},
                    x.valid > 0});
  };
  const auto delays = std::uint64_t{1} << model::effect_index(model::MocapDelay::kInfo.id);
  const bool late = s.options.sensors.mocap.jitter_s > 0 ||
                    (i < size() && sim::storage_of(storage_->batch).effects_of_lane(i) & delays);
  if (i >= size() || !late) {
    s.template for_samples<MocapSample>(i, s.mocap_tap, s.mocap_tap_size, &Slice::mocap, add);
  } else if (!s.mocap_tap.empty()) {
    const T* queue = &s.queue[i / kLanes<T> * s.queue_size];
    for (const Correction& f : s.periods.back().corrections) {
      const T* rows = queue + static_cast<std::ptrdiff_t>(f.slot) * kMocapRows * kLanes<T>;
      add(f.time_s,
          get<MocapSample<double>>(reinterpret_cast<const T(*)[kLanes<T>]>(rows), static_cast<int>(i % kLanes<T>)));
    }
  }
  return list;
}

template <class T>
std::vector<std::span<std::byte>> Fleet<T>::memory() {
  Storage& s = *storage_;
  auto& body = sim::storage_of(s.batch);
  std::vector<std::span<std::byte>> all{
      std::as_writable_bytes(std::span(body.blocks)), std::as_writable_bytes(std::span(s.blocks)),
      std::as_writable_bytes(std::span(s.ring)), std::as_writable_bytes(std::span(s.queue))};
  if (!s.remembered.empty()) all.push_back(std::as_writable_bytes(std::span(s.remembered)));
  if (!s.recalled.empty()) all.push_back(std::as_writable_bytes(std::span(s.recalled)));
  if (!s.late.empty()) all.push_back(std::as_writable_bytes(std::span(s.late)));
  if (!body.lane_effects.empty()) {
    all.push_back(std::as_writable_bytes(std::span(body.lane_effects)));
    all.push_back(std::as_writable_bytes(std::span(body.block_effects)));
    all.push_back(std::as_writable_bytes(std::span(body.effect_rows)));
    all.push_back(std::as_writable_bytes(std::span(body.effect_states)));
  }
  if (!body.points.empty()) {
    all.push_back(std::as_writable_bytes(std::span(body.contact_rows)));
    all.push_back(std::as_writable_bytes(std::span(body.contact_memory)));
  }
  if (body.beat_averaged) {
    all.push_back(std::as_writable_bytes(std::span(body.beat_averaged->rows)));
    all.push_back(std::as_writable_bytes(std::span(body.beat_averaged->memory)));
  }
  if (body.jointed) {
    all.push_back(std::as_writable_bytes(std::span(body.jointed->rows)));
    all.push_back(std::as_writable_bytes(std::span(body.jointed->memory)));
  }
  return all;
}

template <class T>
std::int64_t Fleet<T>::periods() const {
  return sim::storage_of(storage_->batch).steps / storage_->period_steps;
}

template <class T>
void Fleet<T>::restored(std::int64_t periods) {
  Storage& s = *storage_;
  s.schedule = Schedule(s.options.sensors, s.options.batch.step_s, s.period_steps);
  for (std::int64_t k = 0; k < periods; ++k) s.schedule.next();
  sim::storage_of(s.batch).steps = periods * s.period_steps;
}

template <class T>
std::uint64_t Fleet<T>::hash(std::size_t first, std::size_t last) const {
  std::uint64_t all = storage_->batch.hash(first, last);
  for (std::size_t i = first; i < last; ++i) {
    const auto [f, lane] = storage_->at(i);
    std::uint64_t h = 0;
    for (int r = 0; r < kFlightRows<T>; ++r) h = sim::mixed(h, sim::bits_of(rows_of<T>(f)[r][lane]));
    for (const std::uint32_t word : {f.flapper[lane], f.flight[lane], f.tick[lane], f.segment[lane], f.ended[lane]})
      h = sim::mixed(h, word);
    auto& body = sim::storage_of(storage_->batch);
    body.for_states(i, body.effects_of_lane(i) & model::sensor_effects(),
                    [&](T x) { h = sim::mixed(h, sim::bits_of(x)); });
    const auto add = [&, lane = lane](const std::vector<T>& rows_of_all, std::size_t size) {
      for (std::size_t k = static_cast<std::size_t>(lane); k < size; k += kLanes<T>)
        h = sim::mixed(h, sim::bits_of(rows_of_all[i / kLanes<T> * size + k]));
    };
    add(storage_->ring, storage_->ring_size);
    add(storage_->queue, storage_->queue_size);
    add(storage_->remembered, storage_->past_size);
    add(storage_->recalled, storage_->recalled_size);
    add(storage_->late, storage_->late_size);
    all = sim::mixed(all, h);
  }
  return all;
}

template <class T>
std::size_t Fleet<T>::bytes_per_flapper() const {
  const Storage& s = *storage_;
  return (sizeof(FlightBlock<T>) +
          (s.ring_size + s.queue_size + s.past_size + s.recalled_size + s.late_size) * sizeof(T)) /
         kLanes<T>;
}

template class Fleet<float>;
template class Fleet<double>;

}  // namespace flappy::flight
