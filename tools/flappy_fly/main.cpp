// flappy-fly: flies a configuration in closed loop, once or many times, reports the errors, and writes flight logs.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "rollout/fly.hpp"
#include "server/telemetry/telemetry.hpp"

namespace flappy::fly {
namespace {

using Json = nlohmann::ordered_json;
using namespace flight;

constexpr const char* kAxes[6] = {"roll", "pitch", "yaw", "x", "y", "z"};
constexpr const char* kEnds[6] = {"time_out", "contact", "not_finite", "out_of_bounds", "heading_late", "arrival_late"};
constexpr rollout::Errors kPaperExperiment = {1.76, 3.95, 5.23, 34.9, 37.2, 24.4};  // Fei et al., ICRA 2019
constexpr const char* kKeys[6] = {"rms_roll_deg", "rms_pitch_deg", "rms_yaw_deg", "rms_x_mm", "rms_y_mm", "rms_z_mm"};

/// Converts errors to degrees and millimetres.
rollout::Errors shown(rollout::Errors e) {
  for (std::size_t k = 0; k < e.size(); ++k) e[k] *= k < 3 ? 180 / std::numbers::pi : 1000;
  return e;
}

/// A quantile of the rms errors of flights, axis by axis.
rollout::Errors quantiles(const rollout::FlightSummary& s, double share) {
  rollout::Errors all{};
  std::vector<double> axis(s.each.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    for (std::size_t i = 0; i < axis.size(); ++i) axis[i] = s.each[i][k];
    all[k] = axis.empty() ? std::nan("") : io::quantile(axis, share);
  }
  return all;
}

/// Percentage of flights whose rms error is below `limits`, in degrees and mm, axis by axis.
rollout::Errors below(const rollout::FlightSummary& s, const rollout::Errors& limits) {
  rollout::Errors all{};
  for (const rollout::Errors& flight : s.each) {
    const rollout::Errors e = shown(flight);
    for (std::size_t k = 0; k < all.size(); ++k)
      all[k] += 100 * (e[k] < limits[k]) / static_cast<double>(s.each.size());
  }
  return all;
}

void print_row(const std::string& name, const rollout::Errors& e) {
  std::printf("  %-22s", name.c_str());
  for (std::size_t k = 0; k < e.size(); ++k) {
    if (std::isfinite(e[k])) std::printf(k < 3 ? "%8.2f" : "%8.1f", e[k]);
    else std::printf("%8s", "-");
  }
  std::printf("\n");
}

void print_score(const rollout::FlyConfig& config, const rollout::FlightSummary& s) {
  std::printf("  %-22s", "rms in degrees and mm");
  for (const char* axis : kAxes) std::printf("%8s", axis);
  std::printf("\n");
  char settled[40];
  std::snprintf(settled, sizeof settled, "from %g s on", config.settle_s);
  print_row(settled, shown(s.settled));
  if (s.each.size() > 1) {  // a few flights that went wrong make up most of the rms over all flights
    print_row("half of flights below", shown(quantiles(s, 0.5)));
    print_row("90 % of flights below", shown(quantiles(s, 0.9)));
  }
  print_row("with take-off", shown(s.takeoff));
  if (config.fleet.task.name == "hover") {
    print_row("paper, experiment", kPaperExperiment);
    print_row("paper, simulation", {1.60, 3.86, 4.79, 36.5, 38.7, 26.9});
    if (s.each.size() > 1) print_row("% below experiment", below(s, kPaperExperiment));
  }
  if (s.crashed > 0) std::printf("  over the %zu flights that did not crash\n", s.flights - s.crashed);
  std::printf("  never farther than %g m: %.2f %%; crashed: %zu\n", rollout::kFarAway_m, 100 * s.within_share,
              s.crashed);
  for (std::size_t k = 0; k < rollout::kFlightFailures; ++k) {
    const rollout::FailureCount& f = s.failures[k];
    if (f.flights == 0) continue;
    std::string name = name_of(static_cast<rollout::FlightFailure>(k));
    for (char& c : name)
      if (c == '_') c = ' ';
    std::printf("  %zu %s: flight %zu first, at %.2f s; half of them by %.2f s, the last at %.2f s\n", f.flights,
                name.c_str(), config.fleet.first_flapper + f.first_flight, f.first_s, f.median_s, f.last_s);
  }
}

void print_success(const rollout::FlyResult& r) {
  const auto n = static_cast<double>(r.summary.flights);
  std::printf("  captured the goal: %.2f %%; and kept it: %.2f %%\n", 100 * static_cast<double>(r.capture_s.size()) / n,
              100 * static_cast<double>(r.successes) / n);
  if (!r.capture_s.empty())
    std::printf("  time to capture, 10 / 50 / 90 %%: %.3f %.3f %.3f s\n", io::quantile(r.capture_s, 0.1),
                io::median(r.capture_s), io::quantile(r.capture_s, 0.9));
}

void print(const rollout::FlyConfig& config, const rollout::FlyOptions& options, const rollout::FlyResult& r) {
  const rollout::FlightSummary& s = r.summary;
  if (r.stopped) std::printf("stopped: %zu of %zu flights, the last at %g s\n", s.flights, options.count, r.flown_s);
  std::printf("%zu flight%s of %g s, task %s, seed %llu, %s\n", s.flights, s.flights == 1 ? "" : "s", config.duration_s,
              config.fleet.task.name.c_str(), static_cast<unsigned long long>(config.fleet.seed),
              config.precision.c_str());
  if (config.welded) std::printf("  held on a stand: nothing to score\n");
  else print_score(config, s);
  for (std::size_t k = 1; k < 6 && !config.welded; ++k)
    if (r.ended[k] > 0) std::printf("  the task ended by %s: %zu\n", kEnds[k], r.ended[k]);
  if (config.fleet.task.constants.success.by_s > 0) print_success(r);
  if (r.handed_back > 0) std::printf("  handed back to the controller: %zu\n", r.handed_back);
  if (!options.log_folder.empty()) {
    std::printf("  %zu logs in %s\n", r.logs, options.log_folder.c_str());
    if (r.logs < s.flights) std::printf("  %zu flights were too short for a log\n", s.flights - r.logs);
  }
  if (r.mcap) std::printf("  topics in %s\n", options.mcap.c_str());
  else if (!options.mcap.empty()) std::printf("  the flight was too short for topics\n");
  std::printf("  %.2f s, %.1f million steps/s, %.0f times real time, hash %s\n", r.wall_s, r.steps / r.wall_s / 1e6,
              r.steps * config.fleet.batch.step_s / r.wall_s, io::hexadecimal(r.hash).c_str());
  if (r.logs > 0 && config.log.rig) std::printf("checked by: flappy-gap check %s\n", options.log_folder.c_str());
  else if (r.logs > 0) std::printf("%s\n", io::shown_by(options.log_folder.string()).c_str());
}

Json json_of(const rollout::FlyConfig& config, const rollout::FlyOptions& options, const rollout::FlyResult& r) {
  const rollout::FlightSummary& s = r.summary;
  Json json;
  const rollout::Errors settled = shown(s.settled), takeoff = shown(s.takeoff);  // JSON writes NaN as null
  for (std::size_t k = 0; k < 6; ++k) json[kKeys[k]] = settled[k];
  for (std::size_t k = 0; k < 6; ++k) json[std::string(kKeys[k]) + "_takeoff"] = takeoff[k];
  const rollout::Errors half = shown(quantiles(s, 0.5)), most = shown(quantiles(s, 0.9));
  for (std::size_t k = 0; k < 6; ++k) json[std::string(kKeys[k]) + "_median"] = half[k];
  for (std::size_t k = 0; k < 6; ++k) json[std::string(kKeys[k]) + "_p90"] = most[k];
  json["crashed"] = s.crashed;
  json["within_0p3m_fraction"] = config.welded ? Json(nullptr) : Json(s.within_share);
  json["flights"] = s.flights;
  json["duration_s"] = config.duration_s;
  json["settle_s"] = config.settle_s;
  json["seed"] = config.fleet.seed;
  json["first_flapper"] = config.fleet.first_flapper;
  json["task"] = config.fleet.task.name;
  json["stopped"] = r.stopped;
  json["failed"] = s.failed;
  for (std::size_t k = 1; k < rollout::kFlightFailures; ++k) {
    const rollout::FailureCount& f = s.failures[k];
    const auto when = [&](double t_s) { return f.flights > 0 ? Json(t_s) : Json(nullptr); };
    json["failures"][name_of(static_cast<rollout::FlightFailure>(k))] = {
        {"flights", f.flights},
        {"first_flight", f.flights > 0 ? Json(config.fleet.first_flapper + f.first_flight) : Json(nullptr)},
        {"first_s", when(f.first_s)},
        {"median_s", when(f.median_s)},
        {"last_s", when(f.last_s)}};
  }
  for (std::size_t k = 0; k < 6; ++k) json["ended"][kEnds[k]] = r.ended[k];
  json["handed_back"] = r.handed_back;
  if (config.fleet.task.constants.success.by_s > 0) {
    json["success_rate"] = static_cast<double>(r.successes) / static_cast<double>(s.flights);
    json["time_to_capture_p10_s"] = io::quantile(r.capture_s, 0.1);
    json["time_to_capture_median_s"] = io::median(r.capture_s);
    json["time_to_capture_p90_s"] = io::quantile(r.capture_s, 0.9);
  }
  json["hash"] = io::hexadecimal(r.hash);
  json["logs"] = options.log_folder.empty() ? Json(nullptr) : Json(r.logs);
  json["mcap"] = options.mcap.empty() ? Json(nullptr) : Json(r.mcap);
  json["wall"] = {{"total_s", r.wall_s},
                  {"scoring_s", r.scoring_s},
                  {"steps_per_s", r.steps / r.wall_s},
                  {"times_real_time", r.steps * config.fleet.batch.step_s / r.wall_s}};
  json["commit"] = io::commit();
  json["config"] = config.resolved;
  return json;
}

}  // namespace
}  // namespace flappy::fly

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-fly", "Flies a configuration in closed loop, scores the flights, writes their logs.",
                      {"instruction set " + sim::best_instruction_set()});
  const io::Command& app = program.app();
  std::string config_name, log, mcap;
  std::vector<std::string> overrides;
  std::uint64_t seed = 0;
  rollout::FlyOptions options;
  app.option("config", config_name, "what to fly: configs/fly/*.toml").required();
  app.option("--count", options.count, "flights, each with noise of its own").range(1, 1'000'000).shows_default();
  app.option("--log", log, "folder for the log of the flight, or one folder in it for each of several");
  app.option("--mcap", mcap, "file for the flight as topics of ROS 2, for Foxglove and PlotJuggler");
  app.option("--set", overrides, "override a key: flight.duration_s=2, controller.attitude.pitch.p=4").one_at_a_time();
  io::Option seeded =
      app.option("--seed", seed, "in place of flight.seed").range(std::uint64_t{0}, std::uint64_t{INT64_MAX});
  return program.run(argc, argv, [&] {
    if (seeded.given()) overrides.push_back("flight.seed=" + std::to_string(seed));
    rollout::FlyConfig config = rollout::read_fly_config(config_name, overrides);
    config.watch = server::telemetry_of(config.dds, config.fleet.sensors);
    options.log_folder = log;
    options.mcap = mcap;
    io::ProgressLine progress("flown");
    const double started_s = io::steady_seconds();
    options.keep_going = [&](double done) {
      progress.show(done);
      if (config.watch && config.dds.pace > 0) io::sleep_until(started_s + done * config.duration_s / config.dds.pace);
      return !io::interrupted();
    };
    io::stop_on_interrupt();
    const rollout::FlyResult result = rollout::fly(config, options);
    progress.clear();
    fly::print(config, options, result);
    program.write_json(fly::json_of(config, options, result));
  });
}
