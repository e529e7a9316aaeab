#include "busy.hpp"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <memory>

#include "bench_closed_loop.hpp"
#include "bench_learner.hpp"
#include "flappy/batch.hpp"
#include "io/parallel.hpp"

namespace flappy::bench {
namespace {

constexpr double kRate = 1e-4;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Processor time of all threads of this process, s.
double all_processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Runs a busy process on each processor that this process may use.
class BusyLoops {
 public:
  BusyLoops() {
    cpu_set_t all;
    if (sched_getaffinity(0, sizeof all, &all) != 0) return;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &all)) continue;
      const pid_t child = fork();
      if (child > 0) children_.push_back(child);
      if (child != 0) continue;
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      cpu_set_t one;
      CPU_ZERO(&one);
      CPU_SET(cpu, &one);
      sched_setaffinity(0, sizeof one, &one);
      volatile unsigned turns = 0;
      for (;;) turns = turns + 1;
    }
  }
  ~BusyLoops() {
    for (const pid_t child : children_) kill(child, SIGKILL);
    for (const pid_t child : children_) waitpid(child, nullptr, 0);
  }
  BusyLoops(const BusyLoops&) = delete;
  BusyLoops& operator=(const BusyLoops&) = delete;

 private:
  std::vector<pid_t> children_;
};

struct Part {
  std::string name, unit;
  int threads;
  std::function<double()> work;  ///< does some work and returns its amount
};

/// Physics alone: 4,096 flappers, stepped by control periods.
Part batch(const model::Vehicle& vehicle, int threads) {
  const sim::BatchOptions options{.threads = threads};
  const auto flock = std::make_shared<sim::Batch<float>>(4096, vehicle, options);
  return {"batch", "steps", threads, [flock] {
            constexpr int kPeriods = 50, kPeriod = 20;
            for (std::size_t i = 0; i < flock->size(); ++i) {
              flock->reset(i, {});
              flock->set_input(i, {9.8, 0, 0, 0});
            }
            for (int i = 0; i < kPeriods; ++i) flock->step(kPeriod);
            return static_cast<double>(flock->size()) * kPeriods * kPeriod;
          }};
}

std::shared_ptr<flight::Fleet<float>> hovering_fleet(const model::Vehicle& vehicle, const std::string& configs,
                                                     int threads) {
  flight::FleetOptions o = hovering(configs, "paper", "pid");
  o.batch.threads = threads;
  return std::make_shared<flight::Fleet<float>>(1024, vehicle, o);
}

/// The closed loop, as in an evaluation.
Part closed_loop(const model::Vehicle& vehicle, const std::string& configs, int threads) {
  return {"closed loop", "control steps", threads, [fleet = hovering_fleet(vehicle, configs, threads)] {
            for (int i = 0; i < 20; ++i) fleet->step();
            return 20.0 * static_cast<double>(fleet->size());
          }};
}

/// Training as in configs/train/escape.toml: six updates while every flapper flies one action of five control periods.
Part training(const model::Vehicle& vehicle, const std::string& configs, const learn::Replay& replay, int threads) {
  learn::LearnerOptions o = learner_options({128, 128}, 256, true);
  o.threads = io::thread_count(threads);
  const auto learner = std::make_shared<learn::Learner<float>>(o);
  return {
      "training", "updates", threads, [learner, &replay, fleet = hovering_fleet(vehicle, configs, threads)] {
        constexpr std::size_t kUpdates = 6;
        io::together(learner->options().threads, [&] {
          fleet->begin(5);
          for (std::size_t u = 0; u < kUpdates; ++u) {
            const std::size_t first = fleet->blocks() * u / kUpdates, last = fleet->blocks() * (u + 1) / kUpdates;
            learner->update(replay, kRate, kRate, {last - first, [&](std::size_t i) { fleet->fly_block(first + i); }});
          }
          fleet->end();
        });
        return static_cast<double>(kUpdates);
      }};
}

struct Rates {
  double per_processor_s, per_wall_s;
};

Rates run(const Part& part, double seconds) {
  part.work();
  const double processor = all_processor_seconds(), wall = wall_seconds();
  double done = 0, spent = 0;
  do {
    done += part.work();
    spent = all_processor_seconds() - processor;
  } while (spent < seconds);
  return {done / spent, done / (wall_seconds() - wall)};
}

}  // namespace

std::vector<BusyRow> measure_busy(const model::Vehicle& vehicle, const std::string& configs,
                                  const SpeedOptions& options, const std::function<void(int, int)>& progress) {
  const learn::Replay replay = random_replay();
  std::vector<Part> parts;
  for (const int threads : {1, 2, 0}) parts.push_back(batch(vehicle, threads));
  for (const int threads : {1, 2, 0}) parts.push_back(closed_loop(vehicle, configs, threads));
  for (const int threads : {1, 2, 0}) parts.push_back(training(vehicle, configs, replay, threads));
  struct Values {
    std::vector<double> quiet, busy, processor_ratio, wall_ratio;
  };
  std::vector<Values> values(parts.size());
  int done = 0;
  for (int round = 0; round < options.rounds; ++round)
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const Rates quiet = run(parts[p], options.seconds);
      const BusyLoops loops;
      const Rates busy = run(parts[p], options.seconds);
      values[p].quiet.push_back(quiet.per_processor_s);
      values[p].busy.push_back(busy.per_processor_s);
      values[p].processor_ratio.push_back(busy.per_processor_s / quiet.per_processor_s);
      values[p].wall_ratio.push_back(busy.per_wall_s / quiet.per_wall_s);
      progress(++done, options.rounds * static_cast<int>(parts.size()));
    }
  std::vector<BusyRow> rows;
  for (std::size_t p = 0; p < parts.size(); ++p)
    rows.push_back({parts[p].name, parts[p].unit, parts[p].threads, summary(values[p].quiet), summary(values[p].busy),
                    summary(values[p].processor_ratio), summary(values[p].wall_ratio)});
  return rows;
}

}  // namespace flappy::bench
