// flappy-identify calibrate: tests the coverage of a fit's intervals. Fits noisy maps of a known vehicle, and counts how often its true
// parameters are inside the intervals.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include "command.hpp"
#include "fit_options.hpp"
#include "flappy/vehicle_file.hpp"
#include "identify/force_sensor.hpp"
#include "io/progress.hpp"
#include "io/sha256.hpp"
#include "shared_options.hpp"

namespace flappy::identify {
namespace {

struct CalibrationSettings {
  MapSource source;
  FitSettings fit;
  std::string truth, inputs, held_out;
  unsigned seeds = 20;
};

Json run(const CalibrationSettings& s, io::Program& program) {
  const auto began = std::chrono::steady_clock::now();
  const model::Vehicle vehicle = s.source.read_vehicle();
  model::Vehicle truth = model::read_vehicle(s.truth);
  const FitConfig config = s.fit.read_config(vehicle);
  FitOptions options = s.fit.options(s.source.options(vehicle));
  options.progress = [](const std::string&, double, double) { return !io::interrupted(); };
  const std::vector<double*> true_values = fitted_values(config, truth);
  const std::vector<sim::Input> inputs =
      s.inputs.empty() ? default_inputs(vehicle.driver) : read_inputs(s.inputs, vehicle.driver);
  const std::vector<sim::Input> held =
      s.held_out.empty() ? std::vector<sim::Input>{} : read_inputs(s.held_out, vehicle.driver);
  // for each seed: done or not, total error, error on held-out inputs; then for each parameter whether it was seen, and
  // whether the truth is inside its interval
  const std::size_t width = 3 + 2 * config.parameters.size();
  std::vector<double> found(width * s.seeds, 0);
  io::Ranks* const ranks = program.ranks("work: calibrate, " + std::to_string(s.seeds) + " seeds of " +
                                         io::sha256(io::read_text(s.truth) + io::read_text(s.source.vehicle) +
                                                    io::read_text(s.fit.config) + s.fit.method) +
                                         "\n");
  const auto [first, last] = io::own_share(ranks, s.seeds);
  io::stop_on_interrupt();
  io::ProgressLine line("fitted");
  for (std::size_t k = first; k < last && !io::interrupted(); ++k) {
    line.show(static_cast<double>(k - first) / static_cast<double>(last - first));
    const auto seed = static_cast<unsigned>(k + 1);
    double* const of_seed = &found[k * width];
    MeasuredMap measured = simulate_forces(truth, inputs, {}, seed, options.map);
    measured.name = s.inputs.empty() ? "map of " + s.truth : s.inputs;
    const ForceFit fit = fit_forces(vehicle, measured, config, options);
    if (fit.stopped) break;
    of_seed[1] = fit.after.total;
    if (!held.empty()) {
      const MeasuredMap other = simulate_forces(truth, held, {}, seed + 1000000, options.map);
      of_seed[2] = map_error(other.wrenches, force_map<double>(std::span(&fit.vehicle, 1), held, options.map)).total;
    }
    for (std::size_t i = 0; i < config.parameters.size(); ++i) {
      const FittedParameter& p = fit.known.parameters[i];
      of_seed[3 + 2 * i] = p.seen;
      of_seed[4 + 2 * i] = p.seen && p.low <= *true_values[i] && *true_values[i] <= p.high;
    }
    of_seed[0] = 1;
  }
  if (ranks != nullptr) ranks->share(reinterpret_cast<std::byte*>(found.data()), s.seeds, width * sizeof(double));
  struct Count {
    unsigned seen = 0, inside = 0;
  };
  std::vector<Count> counts(config.parameters.size());
  double after = 0, held_error = 0;
  unsigned done = 0;
  for (std::size_t k = 0; k < s.seeds; ++k) {
    const double* const of_seed = &found[k * width];
    done += of_seed[0] > 0;
    after = std::max(after, of_seed[1]);
    held_error = std::max(held_error, of_seed[2]);
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i].seen += of_seed[3 + 2 * i] > 0;
      counts[i].inside += of_seed[4 + 2 * i] > 0;
    }
  }
  line.clear();
  unsigned seen = 0, inside = 0;
  Json parameters = Json::array();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    seen += counts[i].seen;
    inside += counts[i].inside;
    parameters.push_back({{"name", config.parameters[i].path}, {"seen", counts[i].seen}, {"inside", counts[i].inside}});
    std::printf("%-42s seen in %3u of %u, inside its interval in %3u\n", config.parameters[i].path.c_str(),
                counts[i].seen, done, counts[i].inside);
  }
  const double coverage = seen > 0 ? 100.0 * inside / seen : 0;
  std::printf("%u noise seeds: %u of %u inside their 95 %% intervals, %.1f %%; total error at most %.3f %%", done,
              inside, seen, coverage, after);
  if (!held.empty()) std::printf(", held-out inputs at most %.3f %%", held_error);
  std::printf("\n");
  return {{"inputs", inputs.size()},
          {"seeds", done},
          {"seen", seen},
          {"inside", inside},
          {"coverage_percent", coverage},
          {"total_error_after_worst", after},
          {"heldout_error_worst", held.empty() ? Json(nullptr) : Json(held_error)},
          {"parameters", parameters},
          {"wall_s", std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count()}};
}

}  // namespace

Command add_calibrate(io::Program& owner) {
  const io::Command program = owner.app();
  const auto s = std::make_shared<CalibrationSettings>();
  io::Command app = program.command("calibrate", "counts how often a fit's 95 % intervals hold the truth");
  s->source.add(app, "vehicle to start each fit from");
  app.option("--truth", s->truth, "vehicle whose noisy maps are fitted").required();
  app.option("--seeds", s->seeds, "fits, each of noise of its own").range(1, 100000).shows_default();
  app.option("--inputs", s->inputs, "table of inputs to fit; without it, 37 about hover");
  app.option("--held-out-inputs", s->held_out, "table of inputs to judge each fit on");
  s->fit.starts = 1;
  s->fit.add(app);
  return {app, [s, &owner] { return run(*s, owner); }};
}

}  // namespace flappy::identify
