#include "speed.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <numbers>

#include "flappy/batch.hpp"
#include "io/statistics.hpp"
#include "sim/randomise.hpp"
#ifdef FLAPPY_HAVE_PEERS
#include "dart_peer.hpp"
#include "mujoco_peer.hpp"
#endif

namespace flappy::bench {
namespace {

constexpr double kStep_s = sim::kDefaultStep_s;
const int kPeriod = static_cast<int>(std::lround(2e-3 / kStep_s));  // physics steps per control period
constexpr std::size_t kDistinctVehicles = 1024;
/// Longest flight: without a controller a flapper tumbles later, which is not representative.
constexpr double kFlight_s = 0.2;
const int kFlightPeriods = static_cast<int>(kFlight_s / (kPeriod * kStep_s));

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Flappers of different vehicles and inputs, in free flight.
template <class T>
class Flock {
 public:
  Flock(const std::vector<model::Vehicle>& vehicles, std::size_t count, int threads,
        const std::string& instruction_set = "")
      : batch_(count, vehicles[0], {kStep_s, threads, {}, instruction_set}) {
    for (std::size_t i = 0; i < count; ++i) batch_.set_vehicle(i, vehicles[i % vehicles.size()]);
  }

  /// Flies for about `seconds`, at least one control period, with a new start every kFlight_s. Returns seconds per
  /// flapper and step on the given clock.
  double run(double seconds, double (*clock)()) {
    double spent = 0;
    std::int64_t periods = 0;
    while (spent < seconds) {
      for (std::size_t i = 0; i < batch_.size(); ++i) {
        batch_.reset(i, {});
        batch_.set_input(i, {9 + 0.002 * static_cast<double>(i % 1000), 0, 0, 0});
      }
      batch_.step(kPeriod);
      const double start = clock() - spent;
      for (int i = 0; i < kFlightPeriods && spent < seconds; ++i, ++periods) {
        batch_.step(kPeriod);
        spent = clock() - start;
      }
    }
    return spent / (static_cast<double>(periods) * kPeriod * static_cast<double>(batch_.size()));
  }
  std::size_t frozen() const { return batch_.count_status(sim::kFrozen); }

 private:
  sim::Batch<T> batch_;
};

#ifdef FLAPPY_HAVE_PEERS
/// Steps per second of one peer in flights of the same duration at 10 V, with voltages held for 1 ms.
template <class Peer>
double peer_steps_per_s(Peer& peer, double flapping_Hz, double seconds) {
  double spent = 0;
  int steps = 0;
  while (spent < seconds) {
    peer.set_state({});
    const double start = processor_seconds();
    for (int hold = 0; hold < kFlightPeriods * kPeriod / 10; ++hold) {
      const double volts = 10 * std::cos(2 * std::numbers::pi * flapping_Hz * 1e-3 * hold);
      for (int i = 0; i < 10; ++i) peer.step(volts, volts);
    }
    spent += processor_seconds() - start;
    steps += kFlightPeriods * kPeriod;
  }
  return steps / spent;
}
#endif

}  // namespace

double processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Figure summary(std::vector<double> values) {
  const auto [low, high] = std::ranges::minmax(values);
  return {io::median(std::move(values)), low, high};
}

std::optional<double> SpeedReport::median(const std::string& name) const {
  for (const Row& row : rows)
    if (row.name == name) return row.steps_per_s.median;
  return std::nullopt;
}

SpeedReport measure_speed(const model::Vehicle& vehicle, const SpeedOptions& options,
                          const std::function<void(int, int)>& progress) {
  std::vector<model::Vehicle> vehicles;
  for (std::uint32_t i = 0; i < kDistinctVehicles; ++i) {
    vehicles.push_back(vehicle);
    vehicles.back().torso.mass_kg *= 0.9 + 0.0002 * i;
  }
  struct Candidate {
    std::string name;
    std::function<double()> steps_per_s;
    std::vector<double> values;
  };
  std::vector<Candidate> candidates;
  std::vector<std::shared_ptr<Flock<float>>> single;
  std::vector<std::shared_ptr<Flock<double>>> twice;
  const std::vector<std::string> sets = sim::instruction_sets();
  for (auto set = sets.rbegin(); set != sets.rend(); ++set) {
    const std::string suffix = set == sets.rbegin() ? "" : ", " + *set;
    single.push_back(std::make_shared<Flock<float>>(vehicles, 4096, 1, *set));
    twice.push_back(std::make_shared<Flock<double>>(vehicles, 4096, 1, *set));
    candidates.push_back({"float" + suffix,
                          [f = single.back(), &options] { return 1 / f->run(options.seconds, processor_seconds); },
                          {}});
    candidates.push_back({"double" + suffix,
                          [f = twice.back(), &options] { return 1 / f->run(options.seconds, processor_seconds); },
                          {}});
  }
#ifdef FLAPPY_HAVE_PEERS
  if (options.peers) {
    const double hz = vehicle.driver.flapping_Hz;
    candidates.push_back({"MuJoCo",
                          [&vehicle, &options, hz] {
                            reference::MujocoPeer peer(vehicle, {.step_s = kStep_s});
                            return peer_steps_per_s(peer, hz, options.seconds);
                          },
                          {}});
    candidates.push_back({"DART",
                          [&vehicle, &options, hz] {
                            reference::DartPeer peer(vehicle, {.step_s = kStep_s});
                            return peer_steps_per_s(peer, hz, options.seconds);
                          },
                          {}});
  }
#endif
  Flock<float> one(vehicles, 4096, 1), two(vehicles, 4096, 2);
  std::vector<double> scaling;
  const std::vector<std::size_t> sizes = {1000, 10000, 100000};
  std::vector<std::unique_ptr<Flock<float>>> flocks;
  for (const std::size_t n : sizes) flocks.push_back(std::make_unique<Flock<float>>(vehicles, n, 1));
  std::vector<std::vector<double>> size_values(sizes.size());

  for (int round = 0; round < options.rounds; ++round) {
    for (Candidate& c : candidates) c.values.push_back(c.steps_per_s());
    scaling.push_back(one.run(options.seconds, wall_seconds) / two.run(options.seconds, wall_seconds));
    for (std::size_t i = 0; i < sizes.size(); ++i)
      size_values[i].push_back(1e9 * flocks[i]->run(options.seconds, processor_seconds));
    progress(round + 1, options.rounds);
  }

  SpeedReport report;
  for (Candidate& c : candidates) report.rows.push_back({c.name, summary(std::move(c.values))});
  report.two_thread_scaling = summary(std::move(scaling));
  for (std::size_t i = 0; i < sizes.size(); ++i) report.sizes.push_back({sizes[i], summary(std::move(size_values[i]))});
  for (const auto& f : single) report.frozen += f->frozen();
  for (const auto& f : flocks) report.frozen += f->frozen();
  return report;
}

}  // namespace flappy::bench
