#include "rollout/recorder.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "flightlog/log_world.hpp"
#include "io/csv.hpp"
#include "model/derive.hpp"
#include "model/jointed.hpp"
#include "model/math.hpp"
#include "model/wing_beat.hpp"
#include "sim/lanes.hpp"
#include "sim/storage.hpp"
#include "sim/wing_loads.hpp"

namespace flappy::rollout {
namespace {

constexpr double kPi = std::numbers::pi;

/// Rounds to 1 ns, to remove the rounding errors of sums of steps.
double tidy(double t_s) { return std::round(t_s * 1e9) / 1e9; }

/// Columns of the joints' file: angle, rate and torque of each joint; power of each side's muscles; positive_work_J:
/// while a side's power is positive; work_J: negative work subtracted.
const std::vector<std::string> kJointNames = [] {
  std::vector<std::string> names = {"t_s"};
  for (const std::string side : {"left_", "right_"}) {
    for (const char* angle : model::kAngles)
      for (const char* what : {"_rad", "_rate_rad_s", "_torque_Nm"}) names.push_back(side + angle + what);
    names.push_back(side + "power_W");
  }
  names.insert(names.end(), {"positive_work_J", "work_J"});
  return names;
}();

void write_columns(const std::filesystem::path& file, const std::vector<std::string>& names,
                   const std::vector<flightlog::Column>& columns) {
  io::CsvWriter csv(file, names);
  std::vector<double> row(names.size());
  for (std::size_t i = 0; i < columns[0].size(); ++i) {
    for (std::size_t k = 0; k < row.size(); ++k) row[k] = columns[k][i];
    csv.row(row);
  }
  csv.close();
}

/// Columns of the truth: the motion, and what supports the flapper: 0 nothing, 1 the ground, 2 welded to a stand.
const std::vector<std::string> kTruthNames = [] {
  std::vector<std::string> names = flightlog::kMotionNames;
  names.emplace_back("support");
  return names;
}();

/// Each sample is taken at the first control tick at or after its time, from the first tick that is asked about.
class TickSampler {
 public:
  explicit TickSampler(double rate_hz) : rate_hz_(rate_hz) {}
  bool due(double t_s) {
    if (!std::exchange(started_, true)) count_ = static_cast<std::uint32_t>(std::ceil(t_s * rate_hz_ - 1e-9));
    if (t_s < static_cast<double>(count_) / rate_hz_ - 1e-9) return false;
    ++count_;
    return true;
  }
  /// Index of the first of the four normal random numbers that belong to the last sample.
  std::uint32_t first_index() const { return 4 * (count_ - 1); }

 private:
  double rate_hz_;
  std::uint32_t count_ = 0;
  bool started_ = false;
};

}  // namespace

template <class T>
std::vector<DriverUpdate> driver_updates(flight::Fleet<T>& fleet, std::size_t i) {
  using L = model::Lanes<T, 1>;  // same rounding and fused operations as in the kernels
  auto& body = sim::storage_of(fleet.batch());
  const auto [block, lane] = body.at(i);
  const auto drive = sim::get<sim::Drive<double>>(block.drive, lane);
  const auto steps = static_cast<std::int64_t>(std::lround(fleet.period_s() / body.step_s));
  if (block.status[lane] & sim::kDirect)
    return {{body.steps - steps, 0, {}, drive.voltages.left_V, drive.voltages.right_V}};
  const auto parameters = sim::get<model::Parameters<double>>(block.parameters, lane);
  const auto& in = drive.input;
  const auto& limit = drive.limit;
  const auto clip = [](double value, double low, double high) { return model::clamp(value, low, high); };
  const sim::Input u{
      clip(in.amplitude_V, 0, limit.amplitude_V), clip(in.difference_V, -limit.difference_V, limit.difference_V),
      clip(in.bias_V, -limit.bias_V, limit.bias_V), clip(in.split_cycle, -limit.split_cycle, limit.split_cycle)};
  const model::WingBeat<L> beat{L(u.amplitude_V), L(u.difference_V), L(u.bias_V), L(u.split_cycle)};

  std::vector<DriverUpdate> list;
  const auto every = static_cast<std::int64_t>(body.steps_per_update);
  for (std::int64_t step = (body.steps - steps + every - 1) / every * every; step < body.steps; step += every)
    list.push_back({step, 0, u, 0, 0});
  std::uint32_t phase = block.phase[lane];
  for (std::size_t k = list.size(); k-- > 0;) {
    list[k].phase = phase -= block.phase_per_update[lane];
    const L fraction(static_cast<double>(model::beat_fraction<T>(phase)));
    list[k].left_V = model::wing_beat_voltage<+1>(beat, fraction, L(parameters.left.voltage_limit_V)).raw[0];
    list[k].right_V = model::wing_beat_voltage<-1>(beat, fraction, L(parameters.right.voltage_limit_V)).raw[0];
  }
  return list;
}
template std::vector<DriverUpdate> driver_updates(flight::Fleet<float>&, std::size_t);
template std::vector<DriverUpdate> driver_updates(flight::Fleet<double>&, std::size_t);

flightlog::ImuHeader imu_header(const flight::ImuSensor& imu) {
  const double interval_s = 1 / imu.rate_hz, share = flight::low_pass_share(imu.low_pass_hz, interval_s),
               past = 1 - share;
  const auto passes = [&](double hz) {
    const double x = kPi * hz * interval_s;
    return model::sin_cos_wide(x).sin / x * share /
           std::sqrt(1 - 2 * past * model::sin_cos_wide(2 * x).cos + past * past);
  };
  double low = 0, high = imu.rate_hz;  // nothing passes at the rate itself
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (passes(middle) > std::numbers::sqrt2 / 2 ? low : high) = middle;
  }
  const double lag_s = interval_s / 2 + low_pass_lag_s(imu);
  flightlog::ImuHeader h;
  h.rate_hz = imu.rate_hz;
  h.bandwidth_hz = high;
  h.latency_s = std::max(0.0, imu.latency_s + lag_s - 1 / (2 * kPi * high));
  h.position_m = {imu.position_m.x, imu.position_m.y, imu.position_m.z};
  h.gyro_noise_rad_s = imu.gyro_noise_rad_s;
  h.gyro_bias_sd_rad_s = {imu.gyro_bias_sd_rad_s.x, imu.gyro_bias_sd_rad_s.y, imu.gyro_bias_sd_rad_s.z};
  h.accel_noise_m_s2 = imu.accel_noise_m_s2;
  return h;
}

template <class T>
struct Recorder<T>::Storage {
  flight::Fleet<T>& fleet;
  std::size_t flapper;
  sim::RandomKey key;
  flightlog::FlightLog log;
  std::vector<flightlog::Column> truth = std::vector<flightlog::Column>(kTruthNames.size());
  std::vector<flightlog::Column> joints;  // empty without articulated wings
  std::vector<flightlog::Column> loads;   // of the wings; empty where they are not asked for
  TickSampler power{0}, wings{0};
  sim::HeldImpulse given{};  // to the stand, until the last control tick
  sim::FlapperState state;   // at the last control tick
  double held_V[2] = {0, 0};
  struct {
    sim::Block<T> block;
    std::vector<T> effect_states, contact_memory;
  } metered;  // copy of the block at the last control tick, for add_power() and add_loads(); unused without either
  double step_hz;
  struct {
    bool acts = false;  // the policy acts in the period that comes, and so from then on:
    std::vector<double> observation;
  } next;

  Storage(const FlyConfig& config, flight::Fleet<T>& f, std::size_t i, const model::Vehicle& vehicle)
      : fleet(f), flapper(i) {
    const flight::FleetOptions& o = f.options();
    key = {o.seed, o.first_flapper + static_cast<std::uint32_t>(i), 0, sim::Stream::power};
    step_hz = 1 / o.batch.step_s;
    if (std::abs(step_hz - std::round(step_hz)) < 1e-6) step_hz = std::round(step_hz);
    flightlog::FlightHeader& h = log.header;
    h.vehicle = config.vehicle_file_name;
    h.vehicle_sha256 = config.vehicle_sha256;
    h.flapping_Hz = model::beats_Hz(vehicle);
    h.gravity_m_s2 = o.batch.world.gravity_m_s2;
    h.ambient = {config.vehicle.air_density_kg_m3, o.batch.world.ground_z_m, o.batch.world.ceiling_z_m, {}};
    for (const sim::Wall& w : o.batch.world.walls) h.ambient.walls.push_back({w.x_m, w.y_m, w.normal_x, w.normal_y});
    for (const sim::Shape& s : o.batch.world.shapes) flightlog::add_solid(s, h.ambient);
    const flight::MocapSensor& m = o.sensors.mocap;
    h.rig = config.log.rig;
    if (h.rig) {
      log.forces.emplace();
    } else {
      h.mocap = {m.rate_hz, m.latency_s, m.position_noise_m, m.attitude_noise_rad};
      h.imu = imu_header(o.sensors.imu);
    }
    h.power = config.log.power;
    h.wings = config.log.wings;
    h.changes = config.changes;
    if (vehicle.beat_averaged || vehicle.jointed) {
      for (const model::BeatAveraged::Input& input : model::mixed_inputs(vehicle)) h.inputs.push_back(input.name);
      log.command.declared.resize(h.inputs.size());
    } else if (!o.task.sets_voltages()) {
      log.command.inputs.emplace(), log.command.phase_rad.emplace();
    }
    if (vehicle.jointed) joints.resize(kJointNames.size());
    if (h.power) log.power.emplace(), power = TickSampler(h.power->rate_hz);
    if (h.wings) log.wings.emplace(), wings = TickSampler(h.wings->rate_hz);
    if (config.log.wing_loads) loads.resize(flightlog::kWingLoadNames.size());
    if (h.power || !loads.empty()) {  // a meter needs the rows of effects, even if no effect is in force
      sim::storage_of(f.batch()).keep_effects(0);
      sim::storage_of(f.batch()).put_effect_rows(i, vehicle);
    }
    if (h.rig) given = f.batch().stand_impulse(i);
    look();
    add_truth(time_s(sim::storage_of(f.batch()).steps));
    if (config.actor) declare_policy(o.task);
  }

  /// For flappy-gap check --flown: how the policy and its controller begin, and all that it gets and gives.
  void declare_policy(const flight::Task& task) {
    for (const flight::Signal& s : task.observation()) log.header.policy.push_back("observation_" + s.name);
    for (const flight::Signal& s : task.action()) log.header.policy.push_back("action_" + s.name);
    log.policy.emplace().numbers.resize(log.header.policy.size());
    look_ahead();
    const auto& body = sim::storage_of(fleet.batch());
    std::vector<double> memory = fleet.remembered(flapper);
    // from there on alone the exported C can go on as this flapper does
    if (body.steps != 0 || fleet.tick(flapper) != 0 || memory.empty() || task.sets_voltages()) return;
    if (task.action_late_most > 0) return;  // there, each action acts at once
    flightlog::FlownHeader& flown = log.header.flown.emplace();
    const flight::Motion estimate = fleet.estimate(flapper);
    auto& pose = flown.start_pose.emplace();
    std::ranges::copy(estimate.position_m, pose.begin());
    std::ranges::copy(estimate.attitude, pose.begin() + 3);
    flown.start_memory = std::move(memory);
    const auto [block, lane] = sim::storage_of(fleet.batch()).at(flapper);
    flown.start_phase = block.phase[lane];
    flown.imu_latency_s = fleet.options().sensors.imu.latency_s;
    flown.mode = "task";
    flown.begin_s = 0;
  }

  /// Before a control period.
  void look_ahead() {
    const auto repeat = static_cast<std::uint32_t>(fleet.options().task.action_repeat);
    next.acts = fleet.tick(flapper) % repeat == 0 && !fleet.handed_back(flapper);
    if (next.acts) next.observation = fleet.observation(flapper);
  }

  void add_inference(double t_s) {
    if (next.acts) {
      log.policy->t_s.push_back(t_s);
      std::size_t k = 0;
      for (const double x : next.observation) log.policy->numbers[k++].push_back(x);
      for (const T x : fleet.adds(flapper)) {
        if (k == log.policy->numbers.size()) break;
        log.policy->numbers[k++].push_back(static_cast<double>(x));
      }
    }
    look_ahead();
  }

  void look() {
    state = fleet.batch().state(flapper);
    if (!log.power && loads.empty()) return;
    auto& body = sim::storage_of(fleet.batch());
    const std::size_t block = flapper / sim::kLanes<T>;
    const T* states = body.effects_of(block).states;
    metered.block = body.blocks[block];
    metered.effect_states.assign(states, states + body.state_size());
    const T* const bristles = body.effects_of(block).contact.memory;
    metered.contact_memory.assign(bristles, bristles + body.contact_memory_size());
  }

  double time_s(std::int64_t step) const { return static_cast<double>(step) / step_hz; }

  void add_truth(double t_s) {
    const sim::FlapperState& s = state;
    const flight::Motion body = fleet.truth(flapper);
    const auto bias = fleet.gyro_bias_rad_s(flapper);
    const auto& [p, q, v, w] = body;
    const double row[] = {t_s,
                          p[0],
                          p[1],
                          p[2],
                          q[0],
                          q[1],
                          q[2],
                          q[3],
                          v[0],
                          v[1],
                          v[2],
                          w[0],
                          w[1],
                          w[2],
                          s.stroke_rad[0],
                          s.rotation_rad[0],
                          s.stroke_rad[1],
                          s.rotation_rad[1],
                          s.stroke_rate_rad_s[0],
                          s.rotation_rate_rad_s[0],
                          s.stroke_rate_rad_s[1],
                          s.rotation_rate_rad_s[1],
                          s.stroke_acceleration_rad_s2[0],
                          s.rotation_acceleration_rad_s2[0],
                          s.stroke_acceleration_rad_s2[1],
                          s.rotation_acceleration_rad_s2[1],
                          bias[0],
                          bias[1],
                          bias[2],
                          static_cast<double>(fleet.batch().support(flapper))};
    for (std::size_t k = 0; k < truth.size(); ++k) truth[k].push_back(row[k]);
    if (!joints.empty()) add_joints(t_s);
  }

  void add_joints(double t_s) {
    const sim::WingJoints q = fleet.batch().joints(flapper);
    std::size_t k = 0;
    const auto put = [&](double x) { joints[k++].push_back(x); };
    put(t_s);
    for (int side = 0; side < 2; ++side) {
      double power_W = 0;
      for (int j = 0; j < 4; ++j) {
        put(q.angle_rad[side][j]), put(q.rate_rad_s[side][j]), put(q.torque_Nm[side][j]);
        power_W += q.driven[side][j] ? q.torque_Nm[side][j] * q.rate_rad_s[side][j] : 0;
      }
      put(power_W);
    }
    put(fleet.batch().energy_J(flapper));
    put(q.work_J);
  }

  void add_command(const DriverUpdate& u) {
    flightlog::CommandStream& c = log.command;
    c.t_s.push_back(time_s(u.step));
    c.left_voltage_V.push_back(u.left_V);
    c.right_voltage_V.push_back(u.right_V);
    held_V[0] = u.left_V;
    held_V[1] = u.right_V;
    if (!c.inputs) return;  // voltages are set directly
    c.inputs->amplitude_V.push_back(u.input.amplitude_V);
    c.inputs->difference_V.push_back(u.input.difference_V);
    c.inputs->bias_V.push_back(u.input.bias_V);
    c.inputs->split_cycle.push_back(u.input.split_cycle);
    c.phase_rad->push_back(2 * kPi * 0x1p-32 * u.phase);
  }

  void add_inputs(std::int64_t step) {
    const std::vector<double> inputs = sim::storage_of(fleet.batch()).inputs_of(flapper);
    log.command.t_s.push_back(time_s(step));
    for (std::size_t k = 0; k < inputs.size(); ++k) log.command.declared[k].push_back(inputs[k]);
  }

  double normal(sim::Stream stream, std::uint32_t index) {
    key.stream = stream;
    return sim::normal(key, index);
  }

  /// Battery voltage and motor currents at the start of a period; they depend on the voltages from then on, so a copy
  /// of the block repeats the period's first step with a meter.
  void add_power(double t_s) {
    const flightlog::PowerHeader& h = *log.header.power;
    if (!power.due(t_s)) return;
    const std::uint32_t n = power.first_index();
    auto& body = sim::storage_of(fleet.batch());
    constexpr std::size_t kLanes = sim::kLanes<T>;
    const std::size_t lane = flapper % kLanes;
    T voltages_V[2 * kLanes] = {}, meter[sim::kMeterRows * kLanes];
    for (std::size_t side = 0; side < 2; ++side) voltages_V[side * kLanes + lane] = static_cast<T>(held_V[side]);
    sim::BlockEffects<T> in_force = body.effects_of(flapper / kLanes);
    in_force.states = metered.effect_states.data();
    in_force.contact.memory = metered.contact_memory.data();
    in_force.voltages_V = voltages_V;
    in_force.meter = meter;
    in_force.motors = nullptr;  // the step was metered when it was flown
    sim::StepPlan plan = body.plan();
    plan.steps_per_update = 1;
    body.kernel(metered.block, in_force, plan, 0, 1, {});
    const auto noisy = [&](double value, double sd, std::uint32_t k) {
      return value + sd * normal(sim::Stream::power, n + k);
    };
    log.power->t_s.push_back(tidy(t_s + h.latency_s));
    log.power->battery_V.push_back(noisy(h.battery_nominal_V * static_cast<double>(meter[lane]), h.voltage_noise_V, 0));
    log.power->left_current_A.push_back(noisy(static_cast<double>(meter[kLanes + lane]), h.current_noise_A, 1));
    log.power->right_current_A.push_back(noisy(static_cast<double>(meter[2 * kLanes + lane]), h.current_noise_A, 2));
  }

  /// Means over the period from `begin` to `end`, which a copy of the block flies again with the voltages that it had. Call
  /// it before add_command() and add_power(), which change what is held, and the copy.
  void add_loads(std::int64_t begin, std::int64_t end) {
    auto& body = sim::storage_of(fleet.batch());
    sim::BlockEffects<T> in_force = body.effects_of(flapper / sim::kLanes<T>);
    in_force.states = metered.effect_states.data();
    in_force.contact.memory = metered.contact_memory.data();
    const std::vector<DriverUpdate> updates = driver_updates(fleet, flapper);
    std::vector<sim::StepVoltage> voltages;
    sim::StepVoltage now{held_V[0], held_V[1]};
    auto update = updates.begin();
    for (std::int64_t step = begin; step < end; ++step) {
      for (; update != updates.end() && update->step <= step; ++update) now = {update->left_V, update->right_V};
      voltages.push_back(now);
    }
    const auto lane = static_cast<int>(flapper % sim::kLanes<T>);
    const auto mean = sim::mean_wing_loads<T>(metered.block, in_force, body.plan(), lane, voltages);
    std::size_t k = 0;
    const auto put = [&](double x) { loads[k++].push_back(x); };
    put(time_s(end));
    for (const sim::MeanWingLoads& wing : mean) {
      for (const double x : wing.force_N) put(x);
      for (const double x : wing.moment_Nm) put(x);
      put(wing.lift_N), put(wing.drag_N), put(wing.aerodynamic_power_W), put(wing.mechanical_power_W);
    }
  }

  void add_wings(double t_s) {
    if (!wings.due(t_s)) return;
    const std::uint32_t n = wings.first_index();
    const auto seen = [&](double angle, std::uint32_t k) {
      return angle + log.header.wings->noise_rad * normal(sim::Stream::wings, n + k);
    };
    flightlog::WingsStream& w = *log.wings;
    w.t_s.push_back(t_s);
    w.left_stroke_rad.push_back(seen(state.stroke_rad[0], 0));
    w.left_rotation_rad.push_back(seen(state.rotation_rad[0], 1));
    w.right_stroke_rad.push_back(seen(state.stroke_rad[1], 2));
    w.right_rotation_rad.push_back(seen(state.rotation_rad[1], 3));
  }

  /// Means over the control period, in the axes of the sensor and about its place, stamped half-way.
  void add_forces(double begin_s, double end_s) {
    const flightlog::RigHeader& rig = *log.header.rig;
    const sim::HeldImpulse now = fleet.batch().stand_impulse(flapper), before = std::exchange(given, now);
    const Eigen::Quaterniond to_B(rig.attitude[0], rig.attitude[1], rig.attitude[2], rig.attitude[3]);
    Eigen::Vector3d force, moment;
    for (int i = 0; i < 3; ++i) {
      force[i] = (now.force_N_s[i] - before.force_N_s[i]) / (end_s - begin_s);
      moment[i] = (now.moment_Nm_s[i] - before.moment_Nm_s[i]) / (end_s - begin_s);
    }
    moment = to_B.conjugate() * (moment - Eigen::Vector3d(rig.position_m.data()).cross(force));
    force = to_B.conjugate() * force;
    flightlog::ForcesStream& f = *log.forces;
    const auto n = static_cast<std::uint32_t>(6 * f.t_s.size());
    const auto noisy = [&](double value, double sd, std::uint32_t k) {
      return value + sd * normal(sim::Stream::force_sensor, n + k);
    };
    f.t_s.push_back(tidy((begin_s + end_s) / 2 + rig.latency_s));
    f.force_x_N.push_back(noisy(force.x(), rig.force_noise_N, 0));
    f.force_y_N.push_back(noisy(force.y(), rig.force_noise_N, 1));
    f.force_z_N.push_back(noisy(force.z(), rig.force_noise_N, 2));
    f.moment_x_Nm.push_back(noisy(moment.x(), rig.moment_noise_Nm, 3));
    f.moment_y_Nm.push_back(noisy(moment.y(), rig.moment_noise_Nm, 4));
    f.moment_z_Nm.push_back(noisy(moment.z(), rig.moment_noise_Nm, 5));
  }

  void record() {
    const std::int64_t end = sim::storage_of(fleet.batch()).steps;
    const std::int64_t begin = end - std::lround(fleet.period_s() * step_hz);
    bool sampled = false;
    if (!loads.empty()) add_loads(begin, end);
    // Power belongs to the voltages that hold as the period begins: of an update at its first step, else of one before.
    const auto add_power_once = [&] {
      if (!std::exchange(sampled, true) && log.power) add_power(time_s(begin));
    };
    if (!log.header.inputs.empty()) add_inputs(begin);
    else
      for (const DriverUpdate& u : driver_updates(fleet, flapper)) {
        if (u.step > begin) add_power_once();
        add_command(u);
        add_power_once();
      }
    add_power_once();
    if (log.wings) add_wings(time_s(begin));
    if (log.policy) add_inference(time_s(begin));

    look();
    add_truth(time_s(end));
    if (log.forces) return add_forces(time_s(begin), time_s(end));
    for (const auto& s : fleet.imu_samples(flapper)) {
      flightlog::ImuStream& imu = log.imu;
      imu.t_s.push_back(tidy(s.arrival_s));
      imu.gyro_x_rad_s.push_back(s.gyro_rad_s[0]);
      imu.gyro_y_rad_s.push_back(s.gyro_rad_s[1]);
      imu.gyro_z_rad_s.push_back(s.gyro_rad_s[2]);
      imu.accel_x_m_s2.push_back(s.accel_m_s2[0]);
      imu.accel_y_m_s2.push_back(s.accel_m_s2[1]);
      imu.accel_z_m_s2.push_back(s.accel_m_s2[2]);
    }
    for (const auto& s : fleet.mocap_samples(flapper)) {
      if (!s.valid) continue;
      flightlog::MocapStream& m = log.mocap;
      m.t_s.push_back(tidy(s.arrival_s));
      m.x_m.push_back(s.position_m[0]);
      m.y_m.push_back(s.position_m[1]);
      m.z_m.push_back(s.position_m[2]);
      m.qw.push_back(s.attitude[0]);
      m.qx.push_back(s.attitude[1]);
      m.qy.push_back(s.attitude[2]);
      m.qz.push_back(s.attitude[3]);
    }
  }

  /// Whether every stream has at least two samples and no gap that a log may not have, and all overlap in time.
  bool complete() const {
    std::vector<const flightlog::Column*> times = {&log.command.t_s};
    if (log.forces) times.push_back(&log.forces->t_s);
    else times.insert(times.end(), {&log.mocap.t_s, &log.imu.t_s});
    if (log.power) times.push_back(&log.power->t_s);
    if (log.wings) times.push_back(&log.wings->t_s);
    double from = 0, to = 1e300;
    for (const flightlog::Column* t : times) {
      if (t->size() < 2 || flightlog::is_sparse(*t)) return false;
      from = std::max(from, t->front());
      to = std::min(to, t->back());
    }
    return from < to;
  }
};

template <class T>
Recorder<T>::Recorder(const FlyConfig& config, flight::Fleet<T>& fleet, std::size_t i, const model::Vehicle& vehicle)
    : storage_(std::make_unique<Storage>(config, fleet, i, vehicle)) {}
template <class T>
Recorder<T>::~Recorder() = default;
template <class T>
Recorder<T>::Recorder(Recorder&&) noexcept = default;
template <class T>
Recorder<T>& Recorder<T>::operator=(Recorder&&) noexcept = default;

template <class T>
void Recorder<T>::record() {
  storage_->record();
}

template <class T>
const flightlog::FlightLog& Recorder<T>::so_far() const {
  return storage_->log;
}

template <class T>
std::optional<flightlog::FlightLog> Recorder<T>::log() const {
  if (!storage_->complete()) return {};
  flightlog::FlightLog log = storage_->log;
  if (log.policy && (log.policy->t_s.size() < 2 || flightlog::is_sparse(log.policy->t_s)))
    log.policy.reset(), log.header.policy.clear();  // it acted once
  return log;
}

template <class T>
const std::vector<flightlog::Column>& Recorder<T>::wing_loads() const {
  return storage_->loads;
}

template <class T>
bool Recorder<T>::write(const std::filesystem::path& folder) const {
  const std::optional<flightlog::FlightLog> all = log();
  if (!all) return false;
  write_flight_log(folder, *all);
  flightlog::write_truth(folder, kTruthNames, storage_->truth);
  if (!storage_->joints.empty()) write_columns(folder / flightlog::log_file::kJoints, kJointNames, storage_->joints);
  if (!storage_->loads.empty())
    write_columns(folder / flightlog::log_file::kWingLoads, flightlog::kWingLoadNames, storage_->loads);
  return true;
}

template <class T>
double Recorder<T>::bytes_per_s(const FlyConfig& c) {
  const flight::FleetOptions& o = c.fleet;
  const std::size_t inputs = model::mixed_inputs(c.vehicle).size();
  const std::size_t joints =
      (c.vehicle.jointed ? kJointNames.size() : 0) + (c.log.wing_loads ? flightlog::kWingLoadNames.size() : 0);
  const double commands = inputs > 0 ? static_cast<double>(1 + inputs) * o.control_hz : 8 / c.vehicle.driver.hold_s;
  const double numbers = commands + 7 * o.sensors.imu.rate_hz + 8 * o.sensors.mocap.rate_hz +
                         static_cast<double>(kTruthNames.size() + 9 + joints) * o.control_hz;
  return 2 * sizeof(double) * numbers;  // vectors grow by doubling
}

template class Recorder<float>;
template class Recorder<double>;

}  // namespace flappy::rollout
