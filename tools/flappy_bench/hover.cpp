#include "hover.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"
#include "model/coarse_step.hpp"
#include "sim/randomise.hpp"

namespace flappy::bench {
namespace {

struct Job {
  model::Vehicle vehicle;
  std::string precision;
  std::size_t count;
  std::uint64_t seed;
  double duration_s;
  sim::Input input;
  sim::BatchOptions options;
  sim::Randomisation randomisation;
};

Job read_job(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const io::Table root = io::Config::load(path, overrides).root();
  root.schema(1);
  root.accept({"schema", "vehicle", "precision", "count", "seed", "duration_s", "input", "randomisation", "step_s",
               "threads", "world"});
  const model::Vehicle vehicle = model::read_flyable_vehicle(root.file("vehicle"));
  // a vehicle without motors has no voltage limits
  const bool undriven = vehicle.beat_averaged || vehicle.jointed;
  const model::Driver d = undriven ? model::Driver{0, 0, 1e6, 1e6, 1e6, 1e6} : vehicle.driver;
  Job job{vehicle,
          root.choice("precision", {"float", "double"}),
          static_cast<std::size_t>(root.integer("count", 1, 1'000'000)),
          static_cast<std::uint64_t>(root.integer("seed", 0, INT64_MAX)),
          root.number("duration_s", io::positive(1000)),
          {root.number("input.amplitude_V", {0, d.amplitude_limit_V}),
           root.number_or("input.difference_V", 0, {-d.difference_limit_V, d.difference_limit_V}),
           root.number_or("input.bias_V", 0, {-d.bias_limit_V, d.bias_limit_V}),
           root.number_or("input.split_cycle", 0, {-d.split_cycle_limit, d.split_cycle_limit})},
          {},
          sim::Randomisation(vehicle)};
  if (root.has("randomisation"))
    job.randomisation = sim::read_randomisation(vehicle, io::Config::load(root.file("randomisation")).root());
  job.options.step_s = root.number("step_s", {1e-6, 1e-3});
  job.options.threads = static_cast<int>(root.integer_or("threads", 0, 0, 1024));
  job.options.world.gravity_m_s2 = root.number_or("world.gravity_m_s2", 9.81, {0, 100});
  job.options.world.ground_z_m = root.number_or("world.ground_z_m", -1e3);
  job.options.world.ceiling_z_m = root.number_or("world.ceiling_z_m", 1e3);
  root.finish();
  const double steps = vehicle.driver.hold_s / job.options.step_s;
  if (!undriven && std::abs(steps - std::round(steps)) > 1e-6) {
    char what[64];
    std::snprintf(what, sizeof what, "does not divide the driver's hold of %g s", vehicle.driver.hold_s);
    root.fail("step_s", what, "hold_s / n");
  }
  if (const auto coarse = model::coarse_step(vehicle, job.options.step_s)) {
    const std::string enough = "at most " + io::shortest_digits(coarse->enough_s);
    if (coarse->refused) root.fail("step_s", coarse->what, enough);
    root.warn("step_s", coarse->what + "; enough is " + enough);
  }
  return job;
}

template <class T>
nlohmann::ordered_json fly(const Job& job) {
  sim::Batch<T> batch(job.count, job.vehicle, job.options);
  for (std::size_t i = 0; i < job.count; ++i) {
    batch.set_vehicle(i, job.randomisation.sample({.seed = job.seed, .flapper = static_cast<std::uint32_t>(i)}));
    batch.set_input(i, job.input);
  }
  constexpr int kPeriod = 20;  // steps between the checks of plausibility and contact
  const int steps = static_cast<int>(std::lround(job.duration_s / job.options.step_s));
  const auto start = std::chrono::steady_clock::now();
  for (int done = 0; done < steps; done += kPeriod) batch.step(std::min(kPeriod, steps - done));
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  std::vector<double> climb, drift;
  for (std::size_t i = 0; i < job.count; ++i) {
    const sim::FlapperState s = batch.state(i);
    climb.push_back(s.position_m[2]);
    drift.push_back(std::hypot(s.position_m[0], s.position_m[1]));
  }
  const double flown = static_cast<double>(job.count) * steps;
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(batch.hash()));

  std::printf("%zu %s flappers, %g s each in steps of %g us, %s\n", job.count, job.precision.c_str(), job.duration_s,
              job.options.step_s * 1e6, sim::best_instruction_set().c_str());
  std::printf("  %.1f million steps/s, %.0f times real time\n", flown / wall_s / 1e6,
              flown * job.options.step_s / wall_s);
  std::printf("  climb  10 / 50 / 90 %%  %+.3f %+.3f %+.3f m\n", io::quantile(climb, 0.1), io::quantile(climb, 0.5),
              io::quantile(climb, 0.9));
  std::printf("  drift  10 / 50 / 90 %%   %.3f  %.3f  %.3f m\n", io::quantile(drift, 0.1), io::quantile(drift, 0.5),
              io::quantile(drift, 0.9));
  std::printf("  frozen %zu, touched the ground %zu, the ceiling %zu, a wall %zu\n", batch.count_status(sim::kFrozen),
              batch.count_status(sim::kTouchedGround), batch.count_status(sim::kTouchedCeiling),
              batch.count_status(sim::kTouchedWall));
  std::printf("  state hash %s\n", hash);
  return {{"flappers", job.count},
          {"steps", steps},
          {"wall_s", wall_s},
          {"steps_per_s", flown / wall_s},
          {"climb_median_m", io::quantile(climb, 0.5)},
          {"drift_median_m", io::quantile(drift, 0.5)},
          {"frozen", batch.count_status(sim::kFrozen)},
          {"hash", hash}};
}

}  // namespace

nlohmann::ordered_json fly_batch(const std::filesystem::path& config, const std::vector<std::string>& overrides) {
  const Job job = read_job(config, overrides);
  return job.precision == "float" ? fly<float>(job) : fly<double>(job);
}

}  // namespace flappy::bench
