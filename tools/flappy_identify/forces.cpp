// flappy-identify forces: fits a vehicle to a measured force map and writes the fitted vehicle.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "command.hpp"
#include "fit_options.hpp"
#include "flappy/vehicle_file.hpp"
#include "identify/force_fit.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/sha256.hpp"
#include "shared_options.hpp"

namespace flappy::identify {
namespace {

struct Settings {
  MapSource source;
  FitSettings fit;
  std::string measured, out, held_out;
  std::size_t hold_out = 0;
};

void print(const ForceFit& f, const MeasuredMap& measured, const std::optional<double>& held_out, std::size_t held) {
  for (const Stage& s : f.stages)
    std::printf("%-28s %6zu maps %8.2f s   error %.3f %%\n", s.name.c_str(), s.evaluations, s.wall_s, s.error);
  if (f.starts > 1) std::printf("%d of %d starts reached the same optimum\n", f.starts_agreed, f.starts);
  std::printf("%zu inputs, total error %.2f %% before, %.3f %% after", measured.size(), f.before.total, f.after.total);
  if (held_out) std::printf(", %.3f %% on %zu held-out inputs", *held_out, held);
  std::printf("\nmisfit %.3g of the %s noise%s\n", std::sqrt(f.misfit), f.sd_declared ? "declared" : "estimated",
              f.misfit > 2 ? ": the model lacks something, intervals are widened" : "");
  if (!f.left_out.empty()) {
    std::printf("left out of the fit, for the simulated map jumps there:");
    for (const sim::Input& u : f.left_out)
      std::printf(" (%g V, %g V, %g V, %g)", u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle);
    std::printf("\n");
  }
  std::printf("rms error    ");
  for (const std::string& name : channel_names()) std::printf("%13s", name.c_str());
  for (const auto& [what, error] : {std::pair{"before", &f.before}, {"after", &f.after}}) {
    std::printf("\n  %-11s", what);
    for (const double rms : error->rms) std::printf("%13.3g", rms);
  }
  std::printf("\n%-38s %10s %10s   95 %% interval\n", "parameter", "nominal", "value");
  for (const FittedParameter& p : f.parameters) {
    std::printf("%-38s %10.6g %10.6g   %.6g .. %.6g%s%s\n", p.path.c_str(), p.nominal, p.value, p.low, p.high,
                p.seen ? "" : "  unseen by this map: kept", p.seen && p.at_bound ? "  at its bound" : "");
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(f.confounded.size(), 6); ++i)
    std::printf("confounded: %s and %s, correlation %.3f\n", f.confounded[i].first.c_str(),
                f.confounded[i].second.c_str(), f.confounded[i].correlation);
  if (f.confounded.size() > 6) std::printf("confounded: %zu more pairs, see --json\n", f.confounded.size() - 6);
  for (const std::string& line : spring_verdicts(f)) std::printf("%s\n", line.c_str());
  std::printf("singular values %.3g to %.3g (below 3.5: known from its bounds alone)\n", f.singular_values.front(),
              f.singular_values.back());
}

Json json_of(const ForceFit& f, const std::optional<double>& held_out, const std::string& method) {
  Json parameters = Json::array(), confounded = Json::array(), stages = Json::array(), channels = Json::object();
  for (const FittedParameter& p : f.parameters)
    parameters.push_back({{"name", p.path},
                          {"value", p.value},
                          {"low", p.low},
                          {"high", p.high},
                          {"seen", p.seen},
                          {"nominal", p.nominal},
                          {"at_bound", p.at_bound}});
  for (const Confounded& c : f.confounded)
    confounded.push_back({{"first", c.first}, {"second", c.second}, {"correlation", c.correlation}});
  for (const Stage& s : f.stages)
    stages.push_back({{"name", s.name}, {"evaluations", s.evaluations}, {"wall_s", s.wall_s}, {"error", s.error}});
  for (std::size_t k = 0; k < kChannels; ++k)
    channels[channel_names()[k]] = {{"rms_before", f.before.rms[k]}, {"rms_after", f.after.rms[k]}};
  return {{"total_error_before", f.before.total},
          {"total_error_after", f.after.total},
          {"heldout_error", held_out ? Json(*held_out) : Json(nullptr)},
          {"parameters", parameters},
          {"method", method},
          {"misfit", f.misfit},
          {"noise", f.sd_declared ? "declared" : "estimated"},
          {"channels", channels},
          {"confounded", confounded},
          {"singular_values", f.singular_values},
          {"stages", stages},
          {"left_out", f.left_out.size()},
          {"starts", f.starts},
          {"starts_agreed", f.starts_agreed}};
}

/// The fitted vehicle's file, saying how it came about; no time and no path, so the same fit is the same bytes.
std::string vehicle_file(const ForceFit& f, const std::string& from, const std::string& measured_sha256,
                         const std::string& method) {
  char line[160];
  std::snprintf(line, sizeof line, "# total error %.4f %% before, %.4f %% after\n", f.before.total, f.after.total);
  return "# Fitted to a measured force map by flappy-identify, commit " + io::commit() + ", method " + method +
         "\n# from vehicle " + from + "\n# measured file's sha256 " + measured_sha256 + "\n" + line +
         model::vehicle_text(f.vehicle);
}

Json run(const Settings& s) {
  const auto began = std::chrono::steady_clock::now();
  const model::Vehicle vehicle = s.source.read_vehicle();
  const FitConfig config = s.fit.read_config(vehicle);
  const std::string text = io::read_text(s.measured);
  MeasuredMap measured = parse_measured_map(text, s.measured, vehicle.driver), held;
  if (s.hold_out >= measured.size() && s.hold_out > 0)
    throw io::InputError("--hold-out: " + std::to_string(s.hold_out) + " of " + std::to_string(measured.size()) +
                         " inputs; accepted: fewer than there are");
  if (!s.held_out.empty()) held = read_measured_map(s.held_out, vehicle.driver);
  else if (s.hold_out > 0) held = hold_out(measured, s.hold_out);
  { const io::AtomicFile refused_before_the_work(s.out); }

  FitOptions options = s.fit.options(s.source.options(vehicle));
  io::stop_on_interrupt();
  ForceFit fit;
  {
    io::ProgressLine line("fitting");
    options.progress = [&](const std::string& stage, double done, double cost) {
      if (line.due()) line.show(done, stage + ", cost " + in_short(cost));
      return !io::interrupted();
    };
    fit = fit_forces(vehicle, measured, config, options);
  }
  if (io::interrupted()) throw io::InputError("interrupted: no vehicle is written");
  fit.vehicle.name = vehicle.name + "_fitted";
  std::optional<double> held_error;
  if (held.size() > 0)
    held_error =
        map_error(held.wrenches, force_map<double>(std::span(&fit.vehicle, 1), held.inputs, options.map)).total;
  io::write_atomically(s.out, vehicle_file(fit, vehicle.name, io::sha256(text), s.fit.method));
  print(fit, measured, held_error, held.size());
  Json json = json_of(fit, held_error, s.fit.method);
  json["wall_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return json;
}

}  // namespace

Command add_forces(CLI::App& program) {
  const auto s = std::make_shared<Settings>();
  CLI::App* app = program.add_subcommand("forces", "fits a vehicle to a measured force map");
  app->add_option("measured", s->measured, "table of inputs and mean wrenches")->required();
  s->source.add(*app, "vehicle to start from");
  app->add_option("--out", s->out, "vehicle file to write")->required();
  CLI::Option* table = app->add_option("--held-out", s->held_out, "another table, judged and not fitted");
  app->add_option("--hold-out", s->hold_out, "keep this many rows, evenly spread, from the fit")->excludes(table);
  s->fit.add(*app);
  return {app, [s] { return run(*s); }};
}

}  // namespace flappy::identify
