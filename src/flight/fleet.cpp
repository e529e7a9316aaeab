#include "flight/fleet.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "flight/flight_block.hpp"
#include "sim/kernels.hpp"
#include "sim/storage.hpp"

namespace flappy::flight {

#define FLAPPY_DECLARE_LOOP(isa)            \
  inline namespace isa {                    \
  extern const FlyBlock<float> fly_float;   \
  extern const FlyBlock<double> fly_double; \
  }
FLAPPY_DECLARE_LOOP(scalar)
FLAPPY_DECLARE_LOOP(v2)
FLAPPY_DECLARE_LOOP(v3)
FLAPPY_DECLARE_LOOP(v4)
#undef FLAPPY_DECLARE_LOOP

namespace {

using model::Quaternion;
using model::Vec3;
using sim::get;
using sim::put;
using One = model::Lanes<double, 1>;

template <class T>
FlyBlock<T> loop_named(std::string_view instruction_set) {
  const std::string_view name = sim::kernel_named(instruction_set).single.instruction_set;
  const auto pick = [](FlyBlock<float> f, FlyBlock<double> d) {
    if constexpr (sizeof(T) == sizeof(float)) return f;
    else return d;
  };
  if (name == "x86-64-v4") return pick(v4::fly_float, v4::fly_double);
  if (name == "x86-64-v3") return pick(v3::fly_float, v3::fly_double);
  if (name == "x86-64-v2") return pick(v2::fly_float, v2::fly_double);
  return pick(scalar::fly_float, scalar::fly_double);
}

/// The same numbers in another precision.
template <class T, template <class> class S>
S<T> rounded(const S<double>& from) {
  static_assert(sizeof(S<T>) / sizeof(T) == sizeof(from) / sizeof(double));
  S<T> to;
  for (std::size_t i = 0; i < sizeof to / sizeof(T); ++i)
    reinterpret_cast<T*>(&to)[i] = static_cast<T>(reinterpret_cast<const double*>(&from)[i]);
  return to;
}

double square(double x) { return x * x; }

Motion motion(const Vec3<double>& p, const Quaternion<double>& q, const Vec3<double>& v, const Vec3<double>& w) {
  return {{p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}, {v.x, v.y, v.z}, {w.x, w.y, w.z}};
}

}  // namespace

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
  std::size_t ring_size, queue_size;
  std::vector<Segment<T>> path;
  std::shared_ptr<const Actor> actor;
  std::vector<T> actor_numbers;
  const Period* period = nullptr;
  std::vector<T> imu_tap, mocap_tap;
  std::size_t imu_tap_size = 0, mocap_tap_size = 0;
  bool recording = false;

  Storage(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& o, int steps)
      : options(o),
        batch(count, vehicle, o.batch),
        schedule(o.sensors, o.batch.step_s, steps),
        fly(loop_named<T>(o.batch.instruction_set)),
        period_steps(steps) {
    const std::size_t n = batch.storage().blocks.size();
    blocks.resize(n);
    ring_size = static_cast<std::size_t>(schedule.ring_slots()) * kIncrementRows * kLanes<T>;
    queue_size = static_cast<std::size_t>(schedule.queue_slots()) * kMocapRows * kLanes<T>;
    ring.assign(n * ring_size, T(0));
    queue.assign(n * queue_size, T(0));
    for (const Segment<double>& s : o.task.path) {
      Segment<T> to{s.start_tick, {}};
      for (int c = 0; c < 4; ++c)
        for (int k = 0; k < 6; ++k) to.coefficients[c][k] = static_cast<T>(s.coefficients[c][k]);
      path.push_back(to);
    }
    fill_plan();
  }

  void fill_plan() {
    const Sensors& s = options.sensors;
    const double gravity = options.batch.world.gravity_m_s2, period_s = period_steps * options.batch.step_s;
    plan.step = batch.storage().kernel;
    plan.seed = options.seed;
    plan.losses = s.mocap.loss_probability > 0;
    const auto& at = s.imu.position_m;
    plan.imu = rounded<T>(ImuConstants<double>{{at.x, at.y, at.z},
                                               s.imu.gyro_noise_rad_s,
                                               s.imu.accel_noise_m_s2,
                                               low_pass_share(s.imu.low_pass_hz, 1 / s.imu.rate_hz),
                                               gravity});
    plan.mocap = rounded<T>(MocapConstants<double>{s.mocap.position_noise_m, s.mocap.attitude_noise_rad,
                                                   s.mocap.loss_probability, 1 / s.mocap.loss_length});
    const FusionNoise& f = s.fusion;
    plan.fusion = rounded<T>(
        FusionConstants<double>{square(s.imu.gyro_noise_rad_s) / s.imu.rate_hz + square(f.angle_drift_rad_sqrt_s),
                                square(f.gyro_bias_drift_rad_s_sqrt_s),
                                square(s.imu.accel_noise_m_s2) / s.imu.rate_hz + square(f.velocity_drift_m_s_sqrt_s),
                                square(f.accel_bias_drift_m_s2_sqrt_s),
                                square(s.mocap.attitude_noise_rad),
                                square(s.mocap.position_noise_m),
                                gravity,
                                {at.x, at.y, at.z}});
    const Controller& c = options.controller;
    const auto fill = [&](auto constants) {
      constants.velocity_share = low_pass_share(c.velocity_low_pass_hz, period_s);
      constants.rate_share = low_pass_share(c.body_rate_low_pass_hz, period_s);
      constants.period_s = period_s;
      constants.gravity_m_s2 = gravity;
      return constants;
    };
    PidConstants<double> pid = fill(c.pid);
    pid.per_period_Hz = 1 / period_s;
    plan.controller = static_cast<int>(c.kind);
    plan.pid = rounded<T>(pid);
    plan.arc = rounded<T>(fill(c.arc));
    TaskConstants<double> task = options.task.constants;
    task.tick_s = period_s;
    // half-way between ticks, so that rounding cannot move an end by one
    task.limits.time_s = (std::ceil(task.limits.time_s / period_s - 1e-6) - 0.5) * period_s;
    for (double* after : {&task.limits.faced_by_s, &task.limits.arrived_by_s})
      *after = (std::floor(*after / period_s + 1e-6) + 0.5) * period_s;
    plan.task = rounded<T>(task);
    plan.parts = options.task.parts;
    plan.path = {path.data(), static_cast<std::uint32_t>(path.size()), static_cast<T>(period_s)};
  }

  struct Place {
    FlightBlock<T>& block;
    int lane;
  };
  Place at(std::size_t i) {
    const auto place = batch.storage().at(i);
    return {blocks[i / kLanes<T>], place.lane};
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

  void start(std::size_t i, std::uint32_t episode, const sim::FlapperState& state, sim::Start kind);
  void start_fusion(std::size_t i, const Truth<double>& truth, sim::RandomKey key);
};

template <class T>
void Fleet<T>::Storage::start(std::size_t i, std::uint32_t episode, const sim::FlapperState& s, sim::Start kind) {
  batch.reset(i, s, kind);
  const auto [f, lane] = at(i);
  f.flapper[lane] = options.first_flapper + static_cast<std::uint32_t>(i);
  f.flight[lane] = episode;
  f.tick[lane] = f.segment[lane] = f.ended[lane] = 0;
  const Truth<double> truth{{s.position_m[0], s.position_m[1], s.position_m[2]},
                            {s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]},
                            {s.velocity_m_s[0], s.velocity_m_s[1], s.velocity_m_s[2]},
                            {s.body_rate_rad_s[0], s.body_rate_rad_s[1], s.body_rate_rad_s[2]}};
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
  start_fusion(i, truth, key);

  const auto x = get<Estimate<double>>(f.estimate, lane);
  for (auto& row : f.controller) row[lane] = 0;
  if (options.controller.kind == Controller::Kind::pid) {
    Pid<double> pid{};
    pid.velocity_m_s = x.velocity_m_s;
    pid.body_rate_rad_s = x.body_rate_rad_s;
    put(pid, f.controller, lane);
  } else if (options.controller.kind == Controller::Kind::arc) {
    Arc<double> arc{};
    arc.predicted_x_m_s = x.velocity_m_s.x;
    arc.predicted_y_m_s = x.velocity_m_s.y;
    arc.velocity_m_s = x.velocity_m_s;
    arc.body_rate_rad_s = x.body_rate_rad_s;
    put(arc, f.controller, lane);
  }
  put(Episode<double>{}, f.episode, lane);
  double row[kMaxObservation] = {};
  observe(options.task.parts, x, setpoint(f, lane), Episode<double>{}, 0.0, row);
  for (int k = 0; k < kMaxObservation; ++k) f.observation[k][lane] = static_cast<T>(row[k]);
}

/// The estimator has watched the flapper before its start, as well as one pose shows it: what it has in store is a past of
/// steady motion.
template <class T>
void Fleet<T>::Storage::start_fusion(std::size_t i, const Truth<double>& truth, sim::RandomKey key) {
  const auto [f, lane] = at(i);
  const Sensors& s = options.sensors;
  const auto noise = [&](double sd, std::uint32_t first) {
    return Vec3<double>{sd * sim::normal(key, first), sd * sim::normal(key, first + 1),
                        sd * sim::normal(key, first + 2)};
  };
  key.stream = sim::Stream::start_estimate;
  Estimate<double> x{truth.position_m + noise(s.mocap.position_noise_m, 0),
                     turned(truth.attitude, noise(s.mocap.attitude_noise_rad / 2, 3)),
                     truth.velocity_m_s + noise(s.fusion.initial_velocity_sd_m_s, 6), truth.body_rate_rad_s};
  put(x, f.estimate, lane);

  const double gravity = options.batch.world.gravity_m_s2;
  Fusion<double> fusion{};
  FusionConstants<double> place{};
  place.imu_position_m[0] = s.imu.position_m.x;
  place.imu_position_m[1] = s.imu.position_m.y;
  place.imu_position_m[2] = s.imu.position_m.z;
  const Pose<double> imu = imu_pose(place, x);
  fusion.horizon = fusion.now = imu;
  fusion.horizon.position_m = add_scaled(imu.position_m, -schedule.horizon_age_s(), imu.velocity_m_s);
  fusion.now.position_m = add_scaled(imu.position_m, -schedule.present_age_s(), imu.velocity_m_s);
  fusion.body_rate_rad_s = x.body_rate_rad_s;
  const auto& bias = s.imu.gyro_bias_sd_rad_s;
  Covariance<double>& c = fusion.covariance;
  c.angle = square(s.mocap.attitude_noise_rad);
  c.gyro_bias = (square(bias.x) + square(bias.y) + square(bias.z)) / 3;
  c.position = square(s.mocap.position_noise_m);
  c.velocity = square(s.fusion.initial_velocity_sd_m_s);
  c.accel_bias = square(s.fusion.accel_bias_sd_m_s2);
  put(fusion, f.fusion, lane);
  const Vec3<double> weight = transpose_times(rotation_matrix(x.attitude), Vec3<double>{0, 0, gravity});
  std::vector<Advance> past = schedule.pending();
  if (schedule.newest().slot >= 0) past.push_back(schedule.newest());
  for (const Advance& a : past) {
    T* rows = &ring[i / kLanes<T> * ring_size + static_cast<std::size_t>(a.slot * kIncrementRows * kLanes<T>)];
    put(Increment<double>{{0, 0, 0}, a.duration_s * weight}, reinterpret_cast<T(*)[kLanes<T>]>(rows), lane);
  }
  for (int slot = 0; slot < schedule.queue_slots(); ++slot) {  // poses from before the start are not its own
    T* rows = &queue[i / kLanes<T> * queue_size + static_cast<std::size_t>(slot * kMocapRows * kLanes<T>)];
    put(MocapSample<double>{truth.position_m, truth.attitude, 0}, reinterpret_cast<T(*)[kLanes<T>]>(rows), lane);
  }
}

template <class T>
Fleet<T>::Fleet(std::size_t count, const model::Vehicle& vehicle, const FleetOptions& options) {
  const double steps = 1 / (options.control_hz * options.batch.step_s);
  if (!(steps >= 1) || std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("the control period is no whole number of physics steps");
  if (options.task.path.empty()) throw std::invalid_argument("the task has no path");
  storage_ = std::make_unique<Storage>(count, vehicle, options, static_cast<int>(std::lround(steps)));
  // lanes beyond the last flapper fly along, so that no lane ever holds numbers of no flight
  Storage& s = *storage_;
  for (std::size_t i = 0; i < count; ++i) start(i, 0);
  for (std::size_t i = count; count > 0 && i < s.blocks.size() * kLanes<T>; ++i) {
    FlightBlock<T>& f = s.blocks.back();
    const int from = static_cast<int>((count - 1) % kLanes<T>), to = static_cast<int>(i % kLanes<T>);
    T(*rows)[kLanes<T>] = f.imu;
    for (std::size_t r = 0; r < offsetof(FlightBlock<T>, flapper) / sizeof(T[kLanes<T>]); ++r)
      rows[r][to] = rows[r][from];
  }
}

template <class T>
Fleet<T>::~Fleet() = default;
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
void Fleet<T>::set_actor(const std::shared_ptr<const Actor>& actor) {
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
  s.plan.actor = {};
  if (!actor) return;
  s.actor_numbers.clear();
  for (const std::vector<double>* list : {&actor->weights, &actor->mean, &actor->scale})
    for (const double x : *list) s.actor_numbers.push_back(static_cast<T>(x));
  ActorView<T>& a = s.plan.actor;
  a.layers = static_cast<int>(actor->widths.size()) - 1;
  for (std::size_t i = 0; i < actor->widths.size(); ++i) a.widths[i] = actor->widths[i];
  a.hidden = actor->hidden;
  a.weights = s.actor_numbers.data();
  a.mean = a.weights + actor->weights.size();
  a.scale = a.mean + actor->mean.size();
  a.clip = static_cast<T>(actor->clip);
}

template <class T>
void Fleet<T>::set_action(std::size_t i, const double (&action)[kActions]) {
  const auto [f, lane] = storage_->at(i);
  auto e = get<Episode<double>>(f.episode, lane);
  for (int k = 0; k < kActions; ++k) e.action[k] = action[k];
  put(e, f.episode, lane);
}

template <class T>
void Fleet<T>::set_added(std::size_t i, const sim::Input& input) {
  const auto [f, lane] = storage_->at(i);
  auto e = get<Episode<double>>(f.episode, lane);
  const double added[kActions] = {input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle};
  for (int k = 0; k < kActions; ++k) e.added[k] = added[k];
  put(e, f.episode, lane);
}

template <class T>
void Fleet<T>::step() {
  Storage& s = *storage_;
  auto& body = s.batch.storage();
  s.period = &s.schedule.next();
  const Period& period = *s.period;
  s.physics = body.plan();
  FlightPlan<T>& plan = s.plan;
  plan.physics = &s.physics;
  plan.first_step = body.steps;
  plan.slices = period.slices.data();
  plan.slice_count = static_cast<int>(period.slices.size());
  plan.fuse = period.fuse.data();
  plan.fuse_count = static_cast<int>(period.fuse.size());
  plan.advance = period.advance.data();
  plan.replay = period.replay.data();
  plan.replay_count = static_cast<int>(period.replay.size());
  plan.push_slot = period.push_slot;
  plan.newest = period.newest;
  plan.ahead_s = period.ahead_s;
  if (s.recording) {
    s.imu_tap_size = period.slices.size() * kImuSampleRows * kLanes<T>;
    s.mocap_tap_size = period.slices.size() * kMocapRows * kLanes<T>;
    s.imu_tap.resize(s.blocks.size() * s.imu_tap_size);
    s.mocap_tap.resize(s.blocks.size() * s.mocap_tap_size);
  }
  const auto blocks = static_cast<std::ptrdiff_t>(s.blocks.size());
#pragma omp parallel for schedule(static) num_threads(body.threads)
  for (std::ptrdiff_t b = 0; b < blocks; ++b) {
    const auto i = static_cast<std::size_t>(b);
    Tap<T> tap;
    if (s.recording) tap = {&s.imu_tap[i * s.imu_tap_size], &s.mocap_tap[i * s.mocap_tap_size]};
    s.fly({body.blocks[i], body.effects_of(i), s.blocks[i], &s.ring[i * s.ring_size], &s.queue[i * s.queue_size], tap,
           body.block_after(i)},
          plan);
  }
  body.steps += s.period_steps;
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
  const auto [block, lane] = storage_->batch.storage().at(i);
  const auto u = get<sim::Drive<double>>(block.drive, lane).input;
  return {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
}

template <class T>
double Fleet<T>::reward(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return get<Episode<double>>(f.episode, lane).reward;
}
template <class T>
bool Fleet<T>::handed_back(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return get<Episode<double>>(f.episode, lane).handed_back > 0;
}
template <class T>
std::uint32_t Fleet<T>::ended(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.ended[lane];
}
template <class T>
std::uint32_t Fleet<T>::tick(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  return f.tick[lane];
}
template <class T>
std::vector<double> Fleet<T>::observation(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  std::vector<double> row(storage_->options.task.observation().size());
  for (std::size_t k = 0; k < row.size(); ++k) row[k] = f.observation[k][lane];
  return row;
}
template <class T>
std::pair<double, double> Fleet<T>::innovation(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto x = get<Fusion<double>>(f.fusion, lane);
  return {x.angle_innovation, x.position_innovation};
}

template <class T>
std::array<double, 3> Fleet<T>::gyro_bias_rad_s(std::size_t i) const {
  const auto [f, lane] = storage_->at(i);
  const auto bias = get<Imu<double>>(f.imu, lane).gyro_bias_rad_s;
  return {bias.x, bias.y, bias.z};
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
  if (s.imu_tap.empty()) return list;
  storage_->at(i);
  double time = static_cast<double>(s.period->first_step) * s.options.batch.step_s;
  int sample = 0;
  for (const Slice& slice : s.period->slices) {
    time += slice.steps * s.options.batch.step_s;
    if (!slice.imu) continue;
    const T* rows =
        &s.imu_tap[i / kLanes<T> * s.imu_tap_size + static_cast<std::size_t>(sample++ * kImuSampleRows * kLanes<T>)];
    const auto x =
        get<ImuSample<double>>(reinterpret_cast<const T(*)[kLanes<T>]>(rows), static_cast<int>(i % kLanes<T>));
    list.push_back({time + s.options.sensors.imu.latency_s,
                    {x.gyro_rad_s.x, x.gyro_rad_s.y, x.gyro_rad_s.z},
                    {x.accel_m_s2.x, x.accel_m_s2.y, x.accel_m_s2.z}});
  }
  return list;
}

template <class T>
auto Fleet<T>::mocap_samples(std::size_t i) const -> std::vector<MocapRecord> {
  const Storage& s = *storage_;
  std::vector<MocapRecord> list;
  if (s.mocap_tap.empty()) return list;
  storage_->at(i);
  double time = static_cast<double>(s.period->first_step) * s.options.batch.step_s;
  int sample = 0;
  for (const Slice& slice : s.period->slices) {
    time += slice.steps * s.options.batch.step_s;
    if (!slice.mocap) continue;
    const T* rows =
        &s.mocap_tap[i / kLanes<T> * s.mocap_tap_size + static_cast<std::size_t>(sample++ * kMocapRows * kLanes<T>)];
    const auto x =
        get<MocapSample<double>>(reinterpret_cast<const T(*)[kLanes<T>]>(rows), static_cast<int>(i % kLanes<T>));
    if (x.valid <= 0) continue;
    list.push_back({time + s.options.sensors.mocap.latency_s,
                    {x.position_m.x, x.position_m.y, x.position_m.z},
                    {x.attitude.w, x.attitude.x, x.attitude.y, x.attitude.z}});
  }
  return list;
}

template <class T>
std::uint64_t Fleet<T>::hash(std::size_t first, std::size_t last) const {
  std::uint64_t all = storage_->batch.hash(first, last);
  for (std::size_t i = first; i < last; ++i) {
    const auto [f, lane] = storage_->at(i);
    std::uint64_t h = 0;
    const T(*rows)[kLanes<T>] = f.imu;
    for (std::size_t r = 0; r < offsetof(FlightBlock<T>, flapper) / sizeof(T[kLanes<T>]); ++r)
      h = sim::mixed(h, sim::bits_of(rows[r][lane]));
    for (const std::uint32_t word : {f.flapper[lane], f.flight[lane], f.tick[lane], f.segment[lane], f.ended[lane]})
      h = sim::mixed(h, word);
    const auto add = [&, lane = lane](const std::vector<T>& rows_of_all, std::size_t size) {
      for (std::size_t k = static_cast<std::size_t>(lane); k < size; k += kLanes<T>)
        h = sim::mixed(h, sim::bits_of(rows_of_all[i / kLanes<T> * size + k]));
    };
    add(storage_->ring, storage_->ring_size);
    add(storage_->queue, storage_->queue_size);
    all = sim::mixed(all, h);
  }
  return all;
}

template <class T>
std::size_t Fleet<T>::bytes_per_flapper() const {
  return (sizeof(FlightBlock<T>) + (storage_->ring_size + storage_->queue_size) * sizeof(T)) / kLanes<T>;
}

template class Fleet<float>;
template class Fleet<double>;

}  // namespace flappy::flight
