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

struct ForceSettings {
  MapSource source;
  FitSettings fit;
  std::string measured, out, held_out;
  std::size_t hold_out = 0;
};

bool confirmed(const ForceFit& f) { return f.ends.empty() || f.starts_agreed > 1; }

void print_rows(const char* what, const std::vector<std::size_t>& rows, const MeasuredMap& measured) {
  if (rows.empty()) return;
  std::printf("%s", what);
  for (const std::size_t row : rows)
    std::printf(" line %zu (%s)", measured.line(row), text_of(measured.inputs[row]).c_str());
  std::printf("\n");
}

const char* remark(const FittedParameter& p) {
  if (p.at_nominal) return "  unseen by this map: kept";
  if (!p.seen) return "  unseen alone: as fitted";
  return p.at_bound ? "  at its bound" : "";
}

void print_parameters(const ForceFit& f) {
  std::printf("\n%-38s %10s %10s   95 %% interval%s\n", "parameter", "nominal", "value",
              confirmed(f) ? "" : ", of one optimum: no second start found it");
  for (const FittedParameter& p : f.known.parameters)
    std::printf("%-38s %10.6g %10.6g   %.6g .. %.6g%s\n", p.path.c_str(), p.nominal, p.value, p.low, p.high, remark(p));
  const std::vector<Confounded>& pairs = f.known.confounded;
  constexpr std::size_t kShown = 4;
  for (std::size_t i = 0; i < std::min(pairs.size(), kShown); ++i)
    std::printf("confounded: %s and %s, correlation %.3f\n", pairs[i].first.c_str(), pairs[i].second.c_str(),
                pairs[i].correlation);
  if (pairs.size() > kShown) std::printf("confounded: %zu more pairs, see --json\n", pairs.size() - kShown);
  for (const std::string& line : spring_verdicts(f)) std::printf("%s\n", line.c_str());
  std::printf("singular values %.3g to %.3g (below 3.5: known from its bounds alone)\n",
              f.known.singular_values.front(), f.known.singular_values.back());
  for (std::size_t i = 0; i < std::min(f.known.weak.size(), kShown); ++i) {
    std::printf("known from its bounds alone:");
    for (const auto& [path, weight] : f.known.weak[i].members) std::printf(" %+.2f %s", weight, path.c_str());
    std::printf("\n");
  }
  if (f.known.weak.size() > kShown)
    std::printf("known from its bounds alone: %zu more directions, see --json\n", f.known.weak.size() - kShown);
}

void print(const ForceFit& f, const MeasuredMap& measured, const std::optional<double>& held_out, std::size_t held) {
  for (const Stage& s : f.stages)
    std::printf("%-32s %6zu maps %8.2f s   error %.3f %%\n", s.name.c_str(), s.evaluations, s.wall_s, s.error);
  if (f.ends.size() > 1) std::printf("%d of %zu starts reached the same optimum\n", f.starts_agreed, f.ends.size());
  std::printf("%zu inputs, total error %.2f %% before, %.3f %% after", measured.size(), f.before.total, f.after.total);
  if (held_out) std::printf(", %.3f %% on %zu held-out inputs", *held_out, held);
  std::printf("\nmisfit %.3g of the %s noise%s\n", std::sqrt(f.known.misfit), f.sd_declared ? "declared" : "estimated",
              f.known.misfit > 2 ? ": the model lacks something, intervals are widened" : "");
  print_rows("left out of the fit, for the simulated map jumps there:", f.left_out, measured);
  print_rows("fitted though the simulated map jumps there, for too few would remain:", f.jumping_kept, measured);
  if (!f.unchecked.empty()) {
    std::printf("signs that these inputs do not tell:");
    for (const std::string& name : f.unchecked) std::printf(" %s", name.c_str());
    std::printf("\n");
  }
  std::printf("rms error    ");
  for (const std::string& name : channel_names()) std::printf("%13s", name.c_str());
  for (const auto& [what, error] : {std::pair{"before", &f.before}, {"after", &f.after}}) {
    std::printf("\n  %-11s", what);
    for (const double rms : error->rms) std::printf("%13.3g", rms);
  }
  print_parameters(f);
}

Json rows_of(const std::vector<std::size_t>& rows, const MeasuredMap& measured) {
  Json list = Json::array();
  for (const std::size_t row : rows) {
    Json entry = {{"line", measured.line(row)}};
    const auto numbers = numbers_of(measured.inputs[row]);
    for (std::size_t k = 0; k < numbers.size(); ++k) entry[kInputNames[k]] = numbers[k];
    list.push_back(entry);
  }
  return list;
}

Json json_of(const ForceFit& f, const MeasuredMap& measured, const std::optional<double>& held_out,
             const std::string& method) {
  Json parameters = Json::array(), confounded = Json::array(), weak = Json::array(), stages = Json::array(),
       ends = Json::array(), channels = Json::object();
  for (const FittedParameter& p : f.known.parameters)
    parameters.push_back({{"name", p.path},
                          {"value", p.value},
                          {"low", p.low},
                          {"high", p.high},
                          {"seen", p.seen},
                          {"nominal", p.nominal},
                          {"at_bound", p.at_bound},
                          {"at_nominal", p.at_nominal}});
  for (const Confounded& c : f.known.confounded)
    confounded.push_back({{"first", c.first}, {"second", c.second}, {"correlation", c.correlation}});
  for (const WeakDirection& d : f.known.weak) {
    Json members = Json::array();
    for (const auto& [path, weight] : d.members) members.push_back({{"name", path}, {"weight", weight}});
    weak.push_back({{"singular_value", d.singular_value}, {"members", members}});
  }
  for (const Stage& s : f.stages)
    stages.push_back({{"name", s.name}, {"evaluations", s.evaluations}, {"wall_s", s.wall_s}, {"error", s.error}});
  for (const End& end : f.ends) {
    Json values = Json::array();
    for (std::size_t i = 0; i < f.known.parameters.size(); ++i) {
      const FittedParameter& p = f.known.parameters[i];
      values.push_back(p.lower_bound + end.point[static_cast<Eigen::Index>(i)] * (p.upper_bound - p.lower_bound));
    }
    ends.push_back({{"cost", end.cost}, {"values", values}});
  }
  for (std::size_t k = 0; k < kChannels; ++k)
    channels[channel_names()[k]] = {{"rms_before", f.before.rms[k]}, {"rms_after", f.after.rms[k]}};
  return {{"total_error_before", f.before.total},
          {"total_error_after", f.after.total},
          {"heldout_error", held_out ? Json(*held_out) : Json(nullptr)},
          {"parameters", parameters},
          {"method", method},
          {"misfit", f.known.misfit},
          {"noise", f.sd_declared ? "declared" : "estimated"},
          {"channels", channels},
          {"confounded", confounded},
          {"singular_values", f.known.singular_values},
          {"weak_directions", weak},
          {"stages", stages},
          {"left_out", rows_of(f.left_out, measured)},
          {"jumping_kept", rows_of(f.jumping_kept, measured)},
          {"signs_unchecked", f.unchecked},
          {"starts", f.ends.size()},
          {"starts_agreed", f.starts_agreed},
          {"intervals_confirmed", confirmed(f)},
          {"ends", ends}};
}

/// The measured map, and the vehicle's map before and after the fit: [channel][row].
Json map_of(const MeasuredMap& measured, const model::Vehicle& before, const model::Vehicle& after,
            const MapOptions& options) {
  const auto by_channel = [](const std::vector<Wrench>& wrenches) {
    Json json = Json::object();
    for (std::size_t k = 0; k < kChannels; ++k) {
      Json& column = json[channel_names()[k]] = Json::array();
      for (const Wrench& w : wrenches) column.push_back(w[k]);
    }
    return json;
  };
  Json inputs = Json::array(), units = Json::object();
  for (const sim::Input& input : measured.inputs) inputs.push_back(numbers_of(input));
  for (std::size_t k = 0; k < kChannels; ++k) units[channel_names()[k]] = is_force(static_cast<int>(k)) ? "N" : "N m";
  return {{"inputs", inputs},
          {"units", units},
          {"measured", by_channel(measured.wrenches)},
          {"before", by_channel(force_map<double>(std::span(&before, 1), measured.inputs, options))},
          {"after", by_channel(force_map<double>(std::span(&after, 1), measured.inputs, options))}};
}

/// Text of the fitted vehicle's file, with the fit's provenance. It has no time and no path, so equal fits give equal bytes.
std::string vehicle_file(const ForceSettings& s, const ForceFit& f, const std::string& from,
                         const std::string& measured_sha256) {
  char line[160];
  std::snprintf(line, sizeof line, "# total error %.4f %% before, %.4f %% after\n", f.before.total, f.after.total);
  std::string fitted;
  for (const FittedParameter& p : f.known.parameters) {
    fitted += "\n#   " + p.path;
    if (p.at_nominal) fitted += ": unseen, nominal";
    else if (!p.seen) fitted += ": unseen alone";
    if (p.at_bound) fitted += p.seen ? ": at its bound" : ", at its bound";
  }
  const std::string search =
      f.ends.empty()
          ? "population " + std::to_string(s.fit.population) + ", generations " + std::to_string(s.fit.generations)
          : std::to_string(f.starts_agreed) + " of " + std::to_string(f.ends.size()) + " starts agree";
  model::Vehicle without_posterior = f.vehicle;  // the old file's posterior belongs to other parameter values
  without_posterior.posterior.reset();
  return "# Fitted to a measured force map by flappy-identify, commit " + io::commit() + ", method " + s.fit.method +
         "\n# from vehicle " + from + "\n# measured file's sha256 " + measured_sha256 + "\n" + line +
         "# torques about " + s.source.moment_point + ", " + std::to_string(s.hold_out) + " rows held out, " +
         std::to_string(f.left_out.size()) + " left out for jumps\n# configuration's sha256 " +
         io::sha256(io::read_text(s.fit.config)) + "\n# seed " + std::to_string(s.fit.seed) + ", " + search +
         "\n# parameters fitted:" + fitted + "\n" + model::vehicle_text(without_posterior);
}

Json run(const ForceSettings& s) {
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
  if (held.size() > 0) {
    check_scales(held);
    check_held_out(measured, held);
  }
  io::check_output(s.out);

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
  if (fit.stopped) throw io::InputError("interrupted: no vehicle is written");
  fit.vehicle.name = vehicle.name + "_fitted";
  std::optional<double> held_error;
  if (held.size() > 0)
    held_error =
        map_error(held.wrenches, force_map<double>(std::span(&fit.vehicle, 1), held.inputs, options.map)).total;
  io::write_atomically(s.out, vehicle_file(s, fit, vehicle.name, io::sha256(text)));
  print(fit, measured, held_error, held.size());
  Json json = json_of(fit, measured, held_error, s.fit.method);
  json["map"] = map_of(measured, vehicle, fit.vehicle, options.map);
  json["wall_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return json;
}

}  // namespace

Command add_forces(const io::Command& program) {
  const auto s = std::make_shared<ForceSettings>();
  io::Command app = program.command("forces", "fits a vehicle to a measured force map");
  app.option("measured", s->measured, "table of inputs and mean wrenches").required();
  s->source.add(app, "vehicle to start from");
  app.option("--out", s->out, "vehicle file to write").required();
  io::Option table = app.option("--held-out", s->held_out, "another table, judged and not fitted");
  app.option("--hold-out", s->hold_out, "keep this many rows, evenly spread, from the fit")
      .range(0, 1'000'000)
      .excludes(table);
  s->fit.add(app);
  return {app, [s] { return run(*s); }, true};
}

}  // namespace flappy::identify
