// The onboard loop as a program of its own, and a flapper of the simulator at the other end of its bytes.
#pragma once

#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstring>
#include <deque>
#include <limits>
#include <stdexcept>

#include "deploy/flown/onboard_log.hpp"
#include "flight/flight_block.hpp"
#include "hal_simulated.h"
#include "rollout/fly_fixture.hpp"
#include "rollout/recorder.hpp"

namespace flappy::deploy {

/// States and flags, as onboard.h has them.
enum LoopState : std::uint32_t { kRefused, kWaiting, kHovering, kActing, kReturned, kOff };
enum LoopWish : std::int32_t { kNothing, kHover, kManoeuvre, kStop };
enum LoopFlag : std::uint32_t {
  kBadPolicy = 1,
  kBadController = 2,
  kHandedBack = 4,
  kUnready = 8,
  kImuStale = 16,
  kImuLost = 32,
  kPoseStale = 64,
  kPoseLost = 128,
  kLate = 256,
  kPolicyRefused = 512,
  kPolicyTooLong = 1024,
  kClamped = 2048,
  kNotFinite = 4096,
  kStopped = 8192
};

/// Runs until its input ends, or this does.
class LoopProgram {
 public:
  explicit LoopProgram(const std::vector<std::string>& command) {
    std::signal(SIGPIPE, SIG_IGN);
    int in[2], out[2];
    if (pipe(in) != 0 || pipe(out) != 0) throw std::runtime_error("no pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    for (const int end : {in[0], in[1], out[0], out[1]}) posix_spawn_file_actions_addclose(&actions, end);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const int error = posix_spawnp(&child_, arguments[0], &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(in[0]), close(out[1]);
    to_ = in[1], from_ = out[0];
    if (error != 0) throw std::runtime_error(command[0] + " does not run");
  }
  ~LoopProgram() {
    close(to_), close(from_);
    if (child_ > 0) kill(child_, SIGKILL), waitpid(child_, nullptr, 0);
  }
  LoopProgram(const LoopProgram&) = delete;
  LoopProgram& operator=(const LoopProgram&) = delete;

  loop_output exchange(const loop_input& input) {
    send(input);
    loop_output output;
    char* to = reinterpret_cast<char*>(&output);
    for (std::size_t left = sizeof output; left > 0;) {
      pollfd ready{from_, POLLIN, 0};
      if (poll(&ready, 1, 20000) <= 0) throw std::runtime_error("the loop says nothing for 20 s");
      const ssize_t got = read(from_, to, left);
      if (got <= 0) throw std::runtime_error("the loop has ended");
      to += got, left -= static_cast<std::size_t>(got);
    }
    return output;
  }
  /// Its exit code, after being told to end.
  int finish() {
    loop_input last{};
    last.wish = -1;
    send(last);
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  void send(const loop_input& input) {
    const char* from = reinterpret_cast<const char*>(&input);
    for (std::size_t left = sizeof input; left > 0;) {
      const ssize_t put = write(to_, from, left);
      if (put <= 0) throw std::runtime_error("the loop does not listen");
      from += put, left -= static_cast<std::size_t>(put);
    }
  }
  pid_t child_ = 0;
  int to_ = -1, from_ = -1;
};

/// A flight in control periods since its begin; kNever: does not happen.
inline constexpr int kNever = std::numeric_limits<int>::max();
struct Script {
  int periods = 1200;
  int manoeuvre = 600, stop = kNever;
  int imu_silent = kNever, imu_back = kNever;  // no samples arrive from one to before the other
  int mocap_silent = kNever, mocap_back = kNever;
  bool not_numbers = false;  // they do, but they are NaN
  int late = kNever;         // the loop stands still then, for so many periods, and so much longer
  int late_periods = 0;
  std::uint32_t late_us = 0;
};

/// A flapper whose inputs come from a loop; it starts at rest where the task begins.
class LedFlight {
 public:
  LedFlight(const rollout::FlyConfig& config, std::uint32_t flapper, const std::vector<std::string>& program)
      : program_(program), latency_(config.fleet.sensors), fleet_(1, config.vehicle_of(flapper), led(config, flapper)) {
    place(fleet_, config);
    drive_s_ = config.vehicle.driver.hold_s;
    log_.imu_latency_s = latency_.imu.latency_s;
    log_.pose_latency_s = latency_.mocap.latency_s;
    log_.mode = OnboardLog::Mode::hover;
    const double nothing[flight::kMaxActions] = {};
    fleet_.set_adds(0, nothing);
    fleet_.record(true);
    for (int k = -3; k < 0; ++k) before_.push_back(program_.exchange(frame(k, k + 1, kHover)));
  }
  static flight::FleetOptions with_number(flight::FleetOptions o, std::uint32_t flapper) {
    o.first_flapper = flapper;
    o.batch.threads = 1;
    return o;
  }
  /// At rest in the air where the task begins; the estimate is off by a pose's noise.
  static void place(flight::Fleet<float>& fleet, const rollout::FlyConfig& config) {
    const flight::StartRange& start = config.fleet.task.start;
    sim::FlapperState s{};
    for (int i = 0; i < 3; ++i) s.position_m[i] = start.position_m[i].centre;
    s.attitude[0] = std::cos(start.rotation_rad[2].centre / 2);
    s.attitude[3] = std::sin(start.rotation_rad[2].centre / 2);
    fleet.start(0, 0, s, sim::Start::flying);
  }

  /// Before the flight: without a sample.
  const std::vector<loop_output>& before() const { return before_; }
  flight::Fleet<float>& fleet() { return fleet_; }
  LoopProgram& program() { return program_; }
  int period() const { return period_; }
  const loop_output& said() const { return said_; }
  /// What the loop got and gave, as its own log would have it.
  const OnboardLog& log() const { return log_; }

  /// One control period; false where the motors got other voltages than the driver of the flapper.
  bool step(const Script& script) {
    const int held = period_ == script.late ? script.late_periods : 0;
    for (int i = 0; i < held; ++i) fly(script);  // with the inputs of before
    const int wish = period_ == 0                  ? kHover
                     : period_ == script.stop      ? kStop
                     : period_ == script.manoeuvre ? kManoeuvre
                                                   : 0;
    loop_input in = frame(period_, period_ + 1, wish);
    if (period_ - held == script.late) in.now_us += script.late_us;
    if (period_ == 0) rest(in);
    const auto arrived = [&](const auto& s) { return s.arrived_us <= period_us_ * period_; };
    for (; !imu_.empty() && arrived(imu_.front()); imu_.pop_front()) {
      if (in.imu_count == LOOP_IMU) throw std::runtime_error("too many IMU samples");
      auto& to = in.imu[in.imu_count++];
      to.taken_us = kZero_us + static_cast<std::uint32_t>(imu_.front().taken_us);
      std::ranges::copy(imu_.front().x.begin(), imu_.front().x.begin() + 3, to.gyro_rad_s);
      std::ranges::copy(imu_.front().x.begin() + 3, imu_.front().x.begin() + 6, to.accel_m_s2);
      OnboardLog::Imu& logged = log_.imu.emplace_back();
      logged.arrived_s = 1e-6 * static_cast<double>(imu_.front().arrived_us);
      std::ranges::copy(to.gyro_rad_s, logged.rate_rad_s.begin());
      std::ranges::copy(to.accel_m_s2, logged.force_m_s2.begin());
    }
    for (; !poses_.empty() && arrived(poses_.front()); poses_.pop_front()) {
      if (in.pose_count == LOOP_POSES) throw std::runtime_error("too many poses");
      auto& to = in.pose[in.pose_count++];
      to.taken_us = kZero_us + static_cast<std::uint32_t>(poses_.front().taken_us);
      to.valid = poses_.front().valid;
      std::ranges::copy(poses_.front().x.begin(), poses_.front().x.begin() + 3, to.position_m);
      std::ranges::copy(poses_.front().x.begin() + 3, poses_.front().x.end(), to.attitude);
      if (!to.valid) continue;
      OnboardLog::Pose& logged = log_.poses.emplace_back();
      logged.arrived_s = 1e-6 * static_cast<double>(poses_.front().arrived_us);
      std::ranges::copy(to.position_m, logged.position_m.begin());
      std::ranges::copy(to.attitude, logged.attitude.begin());
    }
    said_ = program_.exchange(in);
    const double now_s = 1e-6 * static_cast<double>(period_us_ * period_);
    for (std::uint32_t d = 0; d < said_.drive_count; ++d)
      log_.commands.push_back({now_s + d * drive_s_, said_.volts[d][0], said_.volts[d][1]});
    if (said_.state == kActing && !log_.begin_s) log_.begin_s = now_s;
    const float* u = said_.input;
    fleet_.set_added(0, {u[0], u[1], u[2], u[3]});
    fly(script);
    const auto updates = rollout::driver_updates(fleet_, 0);
    if (held > 0) return true;
    bool same = updates.size() == said_.drive_count;
    for (std::size_t d = 0; same && d < updates.size(); ++d) {
      const std::array<float, 2> is{said_.volts[d][0], said_.volts[d][1]};
      const std::array<float, 2> should{static_cast<float>(updates[d].left_V), static_cast<float>(updates[d].right_V)};
      same = std::bit_cast<std::uint64_t>(is) == std::bit_cast<std::uint64_t>(should);
    }
    return same;
  }

  /// From the place where the task begins, and from its goal.
  double distance_m(double x_m) const {
    const flight::Motion x = fleet_.truth(0);
    return std::hypot(x.position_m[0] - x_m, x.position_m[1], x.position_m[2]);
  }
  double tilt_rad() const {
    const flight::Motion x = fleet_.truth(0);
    const auto& q = x.attitude;
    return std::acos(std::clamp(1 - 2 * (q[1] * q[1] + q[2] * q[2]), -1.0, 1.0));
  }

 private:
  static constexpr std::uint32_t kZero_us = 0xfff00000U;  // the clock wraps after a second
  struct Sample {
    std::int64_t taken_us, arrived_us;
    bool valid;
    std::vector<float> x;
  };

  static flight::FleetOptions led(const rollout::FlyConfig& config, std::uint32_t flapper) {
    flight::FleetOptions o = with_number(config.fleet, flapper);
    o.controller = {};
    return o;
  }
  static std::int64_t whole_us(double s) { return std::llround(s * 1e6); }

  loop_input frame(int from, int to, std::int32_t wish) const {
    loop_input in{};
    in.now_us = kZero_us + static_cast<std::uint32_t>(from * period_us_);
    in.until_us = kZero_us + static_cast<std::uint32_t>(to * period_us_);
    in.wish = wish;
    return in;
  }
  /// What the sensors show before the flight.
  void rest(loop_input& in) {
    const flight::Motion x = fleet_.estimate(0);
    in.imu_count = in.pose_count = 1;
    in.imu[0].taken_us = in.pose[0].taken_us = in.now_us;
    in.imu[0].accel_m_s2[2] = 9.81F;
    in.pose[0].valid = 1;
    for (int i = 0; i < 3; ++i) in.pose[0].position_m[i] = static_cast<float>(x.position_m[i]);
    for (int i = 0; i < 4; ++i) in.pose[0].attitude[i] = static_cast<float>(x.attitude[i]);
    auto& pose = log_.start_pose.emplace();
    std::ranges::copy(in.pose[0].position_m, pose.begin());
    std::ranges::copy(in.pose[0].attitude, pose.begin() + 3);
  }
  void fly(const Script& script) {
    fleet_.step();
    ++period_;
    const auto add = [](std::vector<float>& to, const auto& from) {
      for (const double v : from) to.push_back(static_cast<float>(v));
    };
    for (const auto& s : fleet_.imu_samples(0)) {
      Sample to{whole_us(s.arrival_s - latency_.imu.latency_s), whole_us(s.arrival_s), true, {}};
      add(to.x, s.gyro_rad_s), add(to.x, s.accel_m_s2);
      send(to, imu_, script.imu_silent, script.imu_back, script.not_numbers);
    }
    for (const auto& s : fleet_.mocap_samples(0)) {
      Sample to{whole_us(s.arrival_s - latency_.mocap.latency_s), whole_us(s.arrival_s), s.valid, {}};
      add(to.x, s.position_m), add(to.x, s.attitude);
      send(to, poses_, script.mocap_silent, script.mocap_back, script.not_numbers);
    }
  }
  /// On its way, unless it would arrive in a silence.
  void send(Sample s, std::deque<Sample>& to, int silent, int back, bool not_number) const {
    const std::int64_t frame = (s.arrived_us + period_us_ - 1) / period_us_;
    const bool bad = frame >= silent && frame < back;
    if (bad) s.x[4] = std::nanf("");
    if (!bad || not_number) to.push_back(s);
  }

  LoopProgram program_;
  flight::Sensors latency_;
  flight::Fleet<float> fleet_;
  std::int64_t period_us_ = whole_us(fleet_.period_s());
  int period_ = 0;
  std::deque<Sample> imu_, poses_;
  std::vector<loop_output> before_;
  loop_output said_{};
  OnboardLog log_;
  double drive_s_;
};

}  // namespace flappy::deploy
