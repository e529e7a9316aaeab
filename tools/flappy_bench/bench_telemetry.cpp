#include "bench_telemetry.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "server/telemetry/telemetry.hpp"

namespace flappy::bench {
namespace {

constexpr double kRate_hz = 500;
constexpr int kDomain = 99;  // a DDS domain that nothing else uses

io::DdsConfig config_of(std::size_t flappers) {
  io::DdsConfig c;
  c.enabled = true;
  c.domain = kDomain;
  c.watch.resize(flappers);
  std::iota(c.watch.begin(), c.watch.end(), 0U);
  return c;
}

struct Heard {
  std::size_t poses;
  double median_s, p99_s, most_s;
};

/// Reads all topics until nothing arrives for 1 s; measures the latency of poses by their stamps.
Heard listen(std::size_t flappers) {
  using namespace server;
  const io::DdsConfig c = config_of(flappers);
  const Participant p(c);
  WaitSet waiting(p);
  std::vector<Reader<PoseStamped>> poses;
  std::vector<Reader<Imu>> imus;
  std::vector<Reader<JointState>> joints;
  std::vector<Reader<WingInput>> inputs;
  const Reader<TFMessage> tf(p, "/tf", {true, false, 100});
  const Quality all{false, false, 1000};
  for (std::size_t slot = 0; slot < flappers; ++slot) {
    poses.emplace_back(p, topic_name(c.name_space, slot, "pose"), all);
    imus.emplace_back(p, topic_name(c.name_space, slot, "imu"), all);
    joints.emplace_back(p, topic_name(c.name_space, slot, "joint_states"), all);
    inputs.emplace_back(p, topic_name(c.name_space, slot, "wing_input"), all);
    waiting.add(poses.back().entity());
  }
  std::vector<double> late_s;
  const auto nothing = [](const auto&, const dds_sample_info_t&) {};
  const double until_s = io::steady_seconds() + 20;
  while (io::steady_seconds() < until_s && (waiting.wait(std::chrono::seconds(1)) || late_s.empty())) {
    for (std::size_t slot = 0; slot < flappers; ++slot) {
      poses[slot].take([&](const PoseStamped& m, const dds_sample_info_t&) {
        late_s.push_back(io::steady_seconds() - seconds_of(m.header.stamp));
      });
      imus[slot].take(nothing), joints[slot].take(nothing), inputs[slot].take(nothing);
    }
    tf.take(nothing);
  }
  if (late_s.empty()) return {};
  return {late_s.size(), io::median(late_s), io::quantile(late_s, 0.99), *std::ranges::max_element(late_s)};
}

double cpu_seconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

}  // namespace

TelemetryCost measure_telemetry(std::size_t flappers, double duration_s) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no second process");
  if (child == 0) {
    const Heard heard = listen(flappers);
    _exit(write(ends[1], &heard, sizeof heard) == sizeof heard ? 0 : 1);
  }
  close(ends[1]);
  TelemetryCost cost;
  cost.flappers = flappers;
  {
    server::Telemetry telemetry(config_of(flappers), {});
    io::sleep_until(io::steady_seconds() + 2);  // until both processes have discovered each other
    const double cpu_before_s = cpu_seconds(), start_s = io::steady_seconds();
    const auto periods = static_cast<std::uint64_t>(duration_s * kRate_hz);
    for (std::uint64_t tick = 1; tick <= periods; ++tick) {
      io::sleep_until(start_s + static_cast<double>(tick) / kRate_hz);
      rollout::FlightSample s;
      s.tick = tick;
      for (s.slot = 0; s.slot < flappers; ++s.slot) {
        s.t_s = io::steady_seconds();
        telemetry.see(s);
      }
    }
    cost.cpu_share = (cpu_seconds() - cpu_before_s) / (io::steady_seconds() - start_s) / static_cast<double>(flappers);
    cost.shown = telemetry.shown(), cost.dropped = telemetry.dropped();
  }
  Heard heard{};
  const bool told = read(ends[0], &heard, sizeof heard) == sizeof heard;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  if (!told) throw std::runtime_error("the other process said nothing");
  cost.heard = heard.poses;
  cost.latency_median_s = heard.median_s, cost.latency_p99_s = heard.p99_s, cost.latency_most_s = heard.most_s;
  return cost;
}

}  // namespace flappy::bench
