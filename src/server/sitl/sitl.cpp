#include "server/sitl/sitl.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>

#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "io/toml_writer.hpp"
#include "rollout/recorder.hpp"
#include "rollout/rollout.hpp"
#include "server/telemetry/flapper_topics.hpp"

namespace flappy::server {
namespace {

constexpr Quality kFlight{true, true, 64};  // latched, so that an autopilot that joins late still gets the messages
enum Wish : std::uint8_t { kNothing = 0, kHover = 1, kManoeuvre = 2, kOver = 255 };

/// A sample and the time when it arrives, its latency after it was taken.
template <class Sample>
struct Late {
  double arrives_s;
  Sample sample;
};

template <class T>
class Flight {
 public:
  Flight(const rollout::FlyConfig& config, const SitlOptions& options)
      : config_(config),
        options_(options),
        vehicle_(config.vehicle_of(config.fleet.first_flapper)),
        fleet_(1, vehicle_, led(config)),
        participant_(config.dds),
        topics_(participant_, config.dds.name_space, 0, config.fleet.sensors, kFlight),
        tick_(participant_, topic_name(config.dds.name_space, 0, "tick"), kFlight),
        clock_(participant_, "/clock", kSensorData),
        inputs_(participant_, topic_name(config.dds.name_space, 0, "wing_input"), kFlight),
        waiting_(participant_) {
    waiting_.add(inputs_.entity());
    place();
    const double nothing[flight::kMaxActions] = {};
    fleet_.set_adds(0, nothing);
    fleet_.record(true);
    recorder_.emplace(config_, fleet_, 0, vehicle_);
  }

  SitlResult fly() {
    await_autopilot();
    rest();
    const std::int64_t periods = rollout::Rollout<T>::ticks(config_);
    started_s_ = io::steady_seconds();
    while (period_ < periods) {
      tell(wish());
      const bool answered = await_input();
      if (!answered && io::interrupted()) {
        result_.stopped = true;
        break;
      }
      if (!answered && options_.lock_step)
        throw io::InputError("no input for tick " + std::to_string(period_) + " within " +
                             io::shortest_digits(options_.timeout_s) +
                             " s; accepted: an autopilot that answers every tick, or --real-time");
      result_.missed += !answered;
      fleet_.set_added(0, input_);
      fleet_.step();
      ++period_;
      recorder_->record();
      sense();
      result_.crashed |= fleet_.events(0) != 0;
      result_.stopped =
          options_.keep_going && !options_.keep_going(static_cast<double>(period_) / static_cast<double>(periods));
      if (result_.stopped) break;
    }
    tell(kOver);
    return finished();
  }

 private:
  static flight::FleetOptions led(const rollout::FlyConfig& config) {
    flight::FleetOptions o = config.fleet;
    o.controller = {};
    o.task.action_late_most = 0;  // commands come from outside, as late as they come
    o.batch.threads = 1;
    return o;
  }

  double now_s() const { return static_cast<double>(period_) * fleet_.period_s(); }

  /// Places the vehicle where the task starts: at rest in the air if the task starts in hover.
  void place() {
    const flight::StartRange& start = config_.fleet.task.start;
    if (!start.settled) return rollout::Rollout<T>::start(fleet_, config_, 0, 0, nullptr);
    sim::FlapperState s{};
    for (int i = 0; i < 3; ++i) s.position_m[i] = start.position_m[i].centre;
    s.attitude[0] = std::cos(start.rotation_rad[2].centre / 2);
    s.attitude[3] = std::sin(start.rotation_rad[2].centre / 2);
    fleet_.start(0, 0, s, sim::Start::flying);
  }

  void await_autopilot() {
    const double until_s = io::steady_seconds() + options_.timeout_s;
    while (tick_.readers() == 0) {
      if (io::interrupted()) return;
      if (io::steady_seconds() > until_s)
        throw io::InputError("no autopilot reads " + topic_name(config_.dds.name_space, 0, "tick") + " within " +
                             io::shortest_digits(options_.timeout_s) +
                             " s; accepted: one in the same domain and within dds.reach");
      io::sleep_until(io::steady_seconds() + 0.01);
    }
  }

  /// Queues the sensor samples before the flight: the estimated pose, and an IMU at rest: rates 0, specific force g upward.
  void rest() {
    const flight::Motion x = fleet_.estimate(0);
    PoseSample pose{now_s(), {}, {}};
    std::ranges::copy(x.position_m, pose.position_m);
    std::ranges::copy(x.attitude, pose.attitude);
    poses_.push_back({now_s(), pose});
    imu_.push_back({now_s(), {now_s(), {0, 0, 0}, {0, 0, config_.fleet.batch.world.gravity_m_s2}}});
  }

  Wish wish() const {
    if (period_ == 0) return kHover;
    return period_ == std::llround(options_.manoeuvre_s / fleet_.period_s()) ? kManoeuvre : kNothing;
  }

  void tell(Wish wish) {
    const auto arrived = [&](auto& queue, std::uint32_t& count) {
      for (; !queue.empty() && queue.front().arrives_s <= now_s() + 1e-9; queue.pop_front(), ++count)
        topics_.write(queue.front().sample);
    };
    arrived(imu_, imu_count_);
    arrived(poses_, pose_count_);
    clock_.write({time_of(now_s())});
    Tick tick{};
    tick.stamp = time_of(now_s());
    tick.until = time_of(now_s() + fleet_.period_s());
    tick.tick = static_cast<std::uint64_t>(period_);
    tick.imu = imu_count_, tick.poses = pose_count_;
    tick.wish = wish;
    told_s_ = io::steady_seconds();
    tick_.write(tick);
  }

  /// Takes the inputs that have arrived; returns whether the input for this period is among them.
  bool take_inputs() {
    bool answered = false;
    inputs_.take([&](const WingInput& u, const dds_sample_info_t&) {
      if (u.tick != static_cast<std::uint64_t>(period_)) return void(++result_.stray);
      const double numbers[] = {u.amplitude_v, u.difference_v, u.bias_v, u.split_cycle};
      if (!std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); })) return void(++result_.refused);
      input_ = {u.amplitude_v, u.difference_v, u.bias_v, u.split_cycle};
      answered = true;
    });
    if (answered) round_trips_s_.push_back(io::steady_seconds() - told_s_);
    return answered;
  }

  bool await_input() {
    const double until_s = options_.lock_step ? told_s_ + options_.timeout_s
                                              : started_s_ + static_cast<double>(period_ + 1) * fleet_.period_s();
    bool answered = false;
    for (double left_s; (left_s = until_s - io::steady_seconds()) > 0 && !answered && !io::interrupted();)
      if (waiting_.wait(std::chrono::nanoseconds(std::llround(std::min(left_s, 0.1) * 1e9)))) answered = take_inputs();
    if (!options_.lock_step) io::sleep_until(until_s);
    return answered || take_inputs();
  }

  void sense() {
    const flight::Sensors& sensors = config_.fleet.sensors;
    for (const auto& s : fleet_.imu_samples(0)) {
      ImuReading imu{s.arrival_s - sensors.imu.latency_s, {}, {}};
      std::ranges::copy(s.gyro_rad_s, imu.gyro_rad_s);
      std::ranges::copy(s.accel_m_s2, imu.accel_m_s2);
      imu_.push_back({s.arrival_s, imu});
    }
    for (const auto& s : fleet_.mocap_samples(0)) {
      if (!s.valid) continue;
      PoseSample pose{s.arrival_s - sensors.mocap.latency_s, {}, {}};
      std::ranges::copy(s.position_m, pose.position_m);
      std::ranges::copy(s.attitude, pose.attitude);
      poses_.push_back({s.arrival_s, pose});
    }
    show_recorded();
  }

  /// Publishes what the recorder added in the period; the true joint angles where it records none.
  void show_recorded() {
    const flightlog::FlightLog& log = recorder_->so_far();
    const flightlog::CommandStream& c = log.command;
    for (; applied_ < c.t_s.size(); ++applied_) {
      const std::size_t k = applied_;
      const flightlog::BeatInputs& inputs = *c.inputs;
      topics_.write(
          AppliedSample{c.t_s[k],
                        k,
                        {inputs.amplitude_V[k], inputs.difference_V[k], inputs.bias_V[k], inputs.split_cycle[k]},
                        c.left_voltage_V[k],
                        c.right_voltage_V[k],
                        (*c.phase_rad)[k]});
    }
    for (; log.power && batteries_ < log.power->t_s.size(); ++batteries_) {
      const flightlog::PowerStream& p = *log.power;
      const std::size_t k = batteries_;
      topics_.write(BatterySample{p.t_s[k] - log.header.power->latency_s, p.battery_V[k], p.left_current_A[k],
                                  p.right_current_A[k]});
    }
    if (!log.wings) return topics_.write(now_s(), fleet_.batch().state(0));
    for (; angles_ < log.wings->t_s.size(); ++angles_) {
      const flightlog::WingsStream& w = *log.wings;
      const double nan = std::nan("");
      sim::FlapperState s;
      s.stroke_rad[0] = w.left_stroke_rad[angles_], s.rotation_rad[0] = w.left_rotation_rad[angles_];
      s.stroke_rad[1] = w.right_stroke_rad[angles_], s.rotation_rad[1] = w.right_rotation_rad[angles_];
      for (double* rate : {s.stroke_rate_rad_s, s.rotation_rate_rad_s}) rate[0] = rate[1] = nan;
      topics_.write(w.t_s[angles_], s);
    }
  }

  SitlResult finished() {
    result_.periods = static_cast<std::uint64_t>(period_);
    if (!round_trips_s_.empty()) {
      result_.round_trip_median_s = io::median(round_trips_s_);
      result_.round_trip_p99_s = io::quantile(round_trips_s_, 0.99);
      result_.round_trip_most_s = *std::ranges::max_element(round_trips_s_);
    }
    result_.hash = fleet_.batch().hash(0, 1);
    if (!options_.log_folder.empty() && recorder_->write(options_.log_folder)) {
      flightlog::write_vehicle(options_.log_folder, config_.vehicle_file_name, config_.vehicle_text);
      result_.logged = true;
    }
    return result_;
  }

  const rollout::FlyConfig& config_;
  const SitlOptions& options_;
  model::Vehicle vehicle_;
  flight::Fleet<T> fleet_;
  Participant participant_;
  FlapperTopics topics_;
  Writer<Tick> tick_;
  Writer<Clock> clock_;
  Reader<WingInput> inputs_;
  WaitSet waiting_;
  std::optional<rollout::Recorder<T>> recorder_;
  std::deque<Late<ImuReading>> imu_;
  std::deque<Late<PoseSample>> poses_;
  std::uint32_t imu_count_ = 0, pose_count_ = 0;
  std::size_t applied_ = 0, batteries_ = 0, angles_ = 0;  // rows of the recorder already published
  std::int64_t period_ = 0;
  sim::Input input_{};
  double started_s_ = 0, told_s_ = 0;
  std::vector<double> round_trips_s_;
  SitlResult result_;
};

}  // namespace

SitlResult fly_sitl(const rollout::FlyConfig& config, const SitlOptions& options) {
  if (const flight::Task& task = config.fleet.task; task.sets_voltages())
    throw io::InputError("task " + io::toml_string(task.name) +
                         " sets the motors' voltages, but an autopilot sends inputs of the wing beat; accepted: a task "
                         "whose action is of kind \"wing_beat\"");
  if (config.excitation.acts())
    throw io::InputError(
        "[[excitation]] and [constant_input] would not be flown, because the autopilot sends the inputs; accepted: a "
        "configuration without");
  return config.precision == "float" ? Flight<float>(config, options).fly() : Flight<double>(config, options).fly();
}

}  // namespace flappy::server
