// flappy-eval: scores a policy on thousands of randomised vehicles, next to PID and ARC alone.
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "io/installation.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/schema.hpp"
#include "io/sha256.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "model/effects/registry.hpp"
#include "rollout/evaluation.hpp"
#include "server/telemetry/telemetry.hpp"

namespace flappy::eval {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using flight::Controller;
using rollout::FlyConfig;
using rollout::Quantiles;
using rollout::Rate;
using rollout::Summary;
using Number = std::optional<double>;

constexpr std::size_t kNominalFlights = 20;
constexpr double kHummingbird_s = 0.25;  // duration of the bird's escape, from the study of the manoeuvre
constexpr double kOptimum_s = 0.248;     // direct optimisation on the exact physics, without noise
const std::string kPolicies = std::string("a run folder, ") + policy::kPolicyFiles;

struct Request {
  std::string policy, config, vehicle, task, stream = "test";
  std::vector<std::string> overrides;
  std::size_t episodes = 10000;
  std::uint64_t seed = 1;
  int threads = 0;
  bool no_baselines = false, effects = false;
  std::vector<double> magnitudes = {0.5, 1, 1.5, 2};  ///< that --effects flies, in units of an effect's typical one
  io::Ranks* ranks = nullptr;
};

std::string file_override(const char* key, const fs::path& path) {
  return std::string(key) + "=" + io::toml_string(fs::absolute(path).string());
}

/// The configuration to fly: that of the run that the policy is or lies in, or --config with the policy in it.
FlyConfig read_config(const Request& r) {
  const fs::path policy = r.policy;
  const fs::path of_run = fs::absolute(policy).parent_path() / "config" / "fly.toml";
  fs::path config = !r.config.empty()    ? fs::path(r.config)
                    : fs::exists(of_run) ? of_run
                                         : fs::path(io::config_path("fly/escape.toml"));
  std::vector<std::string> overrides;
  if (fs::is_directory(policy)) {
    if (!r.config.empty())
      throw io::InputError("--config: " + r.policy + " has its own; accepted: --config with a single file");
    config = policy / "config" / "fly.toml";
    if (!fs::exists(config)) throw io::InputError(r.policy + ": holds no config/fly.toml; accepted: " + kPolicies);
  } else if (policy.extension() == ".json") {
    overrides.push_back(file_override("actor", policy));
  }
  for (const std::string key : {"flight.seed", "flight.threads", "flight.first_flapper"})
    if (std::ranges::any_of(r.overrides, [&](const std::string& o) { return o.starts_with(key + "="); }))
      throw io::InputError("--set " + key + ": is not used; accepted: " +
                           (key == "flight.first_flapper" ? "the vehicles of the test stream" : "--" + key.substr(7)));
  if (!r.vehicle.empty()) overrides.push_back(file_override("vehicle", r.vehicle));
  if (!r.task.empty()) overrides.push_back(file_override("task", r.task));
  overrides.insert(overrides.end(), r.overrides.begin(), r.overrides.end());
  FlyConfig c = io::read_of_run(policy, [&] { return rollout::read_fly_config(config, overrides); });
  if (fs::is_directory(policy) && !c.actor)
    throw io::InputError(config.string() + ": actor: is missing; accepted: the trained actor's file");
  c.fleet.seed = r.seed;
  c.fleet.batch.threads = r.threads;
  return c;
}

/// A column of the table: who flies, and the results.
struct Column {
  const char* name;
  std::size_t asked = 0;
  Summary flights, nominal;
  bool stopped = false;
  double wall_s = 0, steps = 0;
};

class Evaluation {
 public:
  Evaluation(const Request& request, const FlyConfig& config)
      : config_(config),
        options_{.count = request.episodes,
                 .first_flapper = request.stream == "test" ? rollout::kTestFlappers : rollout::kValidationFlappers,
                 .ranks = request.ranks},
        evaluator_(config, options_),
        nominal_(rollout::nominal(rollout::unwatched(config)), nominal_options()) {}

  Column fly_policy(const rollout::Agent& agent) { return fly("policy", evaluator_, nominal_, agent); }

  /// Flies the policy's vehicles by a controller alone, which also holds the hover before.
  Column fly_alone(const char* name, const Controller& controller) {
    if (controller.kind == config_.fleet.controller.kind) return fly(name, evaluator_, nominal_, {});
    FlyConfig other = rollout::unwatched(config_);
    other.fleet.controller = controller;
    rollout::Evaluator evaluator(other, options_), nominal(rollout::nominal(other), nominal_options());
    return fly(name, evaluator, nominal, {});
  }

 private:
  rollout::EvaluationOptions nominal_options() const {
    rollout::EvaluationOptions o = options_;
    o.count = kNominalFlights;
    return o;
  }

  Column fly(const char* name, rollout::Evaluator& evaluator, rollout::Evaluator& nominal,
             const rollout::Agent& agent) const {
    io::ProgressLine progress(std::string(name) + " flown");
    Column column{.name = name, .asked = options_.count};
    const auto keep_going = [&](double done) {
      progress.show(done);
      return !io::interrupted();
    };
    const rollout::Evaluation few =
        nominal.fly(agent, rollout::Detail::full, [](double) { return !io::interrupted(); });
    column.nominal = rollout::summarise(few.flights);
    column.stopped = few.stopped;
    if (few.stopped) return column;
    const rollout::Evaluation all = evaluator.fly(agent, rollout::Detail::full, keep_going);
    column.flights = rollout::summarise(all.flights);
    column.stopped = all.stopped;
    column.wall_s = few.wall_s + all.wall_s;
    column.steps = few.steps + all.steps;
    return column;
  }

  const FlyConfig& config_;
  rollout::EvaluationOptions options_;
  rollout::Evaluator evaluator_, nominal_;
};

Number finite(Number x) { return x && std::isfinite(*x) ? x : std::nullopt; }
Number times(Number x, double factor) { return finite(x) ? Number(*x * factor) : std::nullopt; }
Number if_flown(const Summary& s, double x) { return s.flights > 0 ? Number(x) : std::nullopt; }
constexpr double kDegrees = 180 / std::numbers::pi;

/// Prints one row of the table.
void print_row(const std::string& name, const std::vector<Column>& columns, int digits, const auto& number) {
  std::printf("  %-34s", name.c_str());
  for (const Column& c : columns) {
    const Number x = number(c);
    if (x) std::printf("%12.*f", digits, *x);
    else std::printf("%12s", "-");
  }
  std::printf("\n");
}

void print_rate(const std::string& name, const std::vector<Column>& columns, Rate Summary::*rate) {
  print_row(name, columns, 2, [&](const Column& c) { return if_flown(c.flights, 100 * (c.flights.*rate).value); });
  print_row("  95 % interval, from", columns, 2,
            [&](const Column& c) { return if_flown(c.flights, 100 * (c.flights.*rate).low); });
  print_row("  to", columns, 2, [&](const Column& c) { return if_flown(c.flights, 100 * (c.flights.*rate).high); });
}

void print_quantiles(const std::string& name, const std::vector<Column>& columns, int digits, Quantiles Summary::*of,
                     double factor = 1) {
  const auto row = [&](const std::string& label, Number Quantiles::*part) {
    print_row(label, columns, digits, [&](const Column& c) { return times(c.flights.*of.*part, factor); });
  };
  row(name + ", median", &Quantiles::median);
  row("  10 %", &Quantiles::p10);
  row("  90 %", &Quantiles::p90);
}

void print_failures(const std::vector<Column>& columns) {
  const auto count = [&](const std::string& name, const auto& of) {
    bool any = false;
    for (const Column& c : columns) any = any || of(c) > 0;
    if (any)
      print_row(name, columns, 0, [&](const Column& c) { return if_flown(c.flights, static_cast<double>(of(c))); });
  };
  const auto shown = [](std::string name) {
    for (char& c : name)
      if (c == '_') c = ' ';
    return name;
  };
  for (std::size_t k = 1; k < rollout::kTaskFailures; ++k) {
    const auto failure = static_cast<rollout::TaskFailure>(k);
    count("failed: " + shown(name_of(failure)), [&](const Column& c) { return c.flights.failures[k]; });
    for (std::size_t d = 0; d < rollout::kDemands && failure == rollout::TaskFailure::never_captured; ++d)
      count("  missing most: " + shown(name_of(static_cast<rollout::Demand>(d))),
            [&](const Column& c) { return c.flights.missing[d]; });
  }
}

void print(const Request& request, const FlyConfig& config, const std::vector<Column>& columns) {
  for (const Column& c : columns)
    if (c.stopped) std::printf("stopped: %s flew %zu of %zu flights\n", c.name, c.flights.flights, c.asked);
  std::printf("%zu flights of %g s, task %s, seed %llu, %s vehicles, %s\n", columns[0].flights.flights,
              config.duration_s, config.fleet.task.name.c_str(), static_cast<unsigned long long>(request.seed),
              request.stream.c_str(), config.precision.c_str());
  std::printf("  %-34s", "");
  for (const Column& c : columns) std::printf("%12s", c.name);
  std::printf("\n");
  print_rate("success, %", columns, &Summary::success);
  print_rate("captured the goal, %", columns, &Summary::captured);
  print_quantiles("time to capture, s", columns, 3, &Summary::capture_s);
  print_quantiles("overshoot, mm", columns, 1, &Summary::overshoot_m, 1000);
  print_quantiles("final position error, mm", columns, 1, &Summary::position_error_m, 1000);
  print_quantiles("final heading error, deg", columns, 1, &Summary::heading_error_rad, kDegrees);
  if (const auto& muscles = config.vehicle.jointed) {  // these are small, and belong to the wings' muscles
    print_quantiles("muscles' work in the manoeuvre, mJ", columns, 3, &Summary::energy_J, 1e3);
    print_quantiles("mean muscle power, mW", columns, 3, &Summary::power_W, 1e3);
    if (muscles->muscle_mass_kg > 0)
      print_quantiles("mean muscle power, W/kg", columns, 1, &Summary::power_W, 1 / muscles->muscle_mass_kg);
  } else {
    print_quantiles("energy of the manoeuvre, J", columns, 3, &Summary::energy_J);
    print_quantiles("mean power, W", columns, 2, &Summary::power_W);
  }
  print_failures(columns);
  std::printf("  nominal vehicle, %zu flights from the middle of the start\n", kNominalFlights);
  print_row("strict goal reached, %", columns, 0,
            [](const Column& c) { return if_flown(c.nominal, 100 * c.nominal.strict.value); });
  print_row("time to it, s, median", columns, 3, [](const Column& c) { return finite(c.nominal.strict_s.median); });
  if (config.fleet.task.name == "escape")
    std::printf("  the hummingbird: %.2f s; the study's optimum: %.3f s\n", kHummingbird_s, kOptimum_s);
  double wall_s = 0, steps = 0;
  for (const Column& c : columns) wall_s += c.wall_s, steps += c.steps;
  std::printf("  %.1f s, %.1f million steps/s, hash %s\n", wall_s, wall_s > 0 ? steps / wall_s / 1e6 : 0,
              io::hexadecimal(columns[0].flights.hash).c_str());
}

Json or_null(Number x) { return finite(x) ? Json(*x) : Json(nullptr); }

void put_quantiles(Json& json, const std::string& name, const std::string& unit, const Quantiles& s,
                   double factor = 1) {
  json[name + "_median_" + unit] = or_null(times(s.median, factor));
  json[name + "_p10_" + unit] = or_null(times(s.p10, factor));
  json[name + "_p90_" + unit] = or_null(times(s.p90, factor));
}

/// The results of one column; without wall-clock time, so that the same run gives the same bytes.
Json json_of(const Column& c) {
  const Summary& s = c.flights;
  const auto figure = [&](double x) { return or_null(if_flown(s, x)); };
  Json json = {{"episodes", s.flights},
               {"stopped", c.stopped},
               {"success_rate", figure(s.success.value)},
               {"success_low", figure(s.success.low)},
               {"success_high", figure(s.success.high)},
               {"captured_rate", figure(s.captured.value)}};
  put_quantiles(json, "time_to_capture", "s", s.capture_s);
  json["strict_rate"] = figure(s.strict.value);
  put_quantiles(json, "time_to_strict", "s", s.strict_s);
  put_quantiles(json, "overshoot", "mm", s.overshoot_m, 1000);
  // these keys hold medians
  json["final_position_error_mm"] = or_null(times(s.position_error_m.median, 1000));
  json["final_position_error_p90_mm"] = or_null(times(s.position_error_m.p90, 1000));
  json["final_heading_error_deg"] = or_null(times(s.heading_error_rad.median, kDegrees));
  json["final_heading_error_p90_deg"] = or_null(times(s.heading_error_rad.p90, kDegrees));
  put_quantiles(json, "energy", "J", s.energy_J);
  put_quantiles(json, "mean_power", "W", s.power_W);
  for (std::size_t k = 1; k < rollout::kTaskFailures; ++k)
    json["failures"][name_of(static_cast<rollout::TaskFailure>(k))] = s.failures[k];
  for (std::size_t d = 0; d < rollout::kDemands; ++d)
    json["never_captured_missing"][name_of(static_cast<rollout::Demand>(d))] = s.missing[d];
  json["nominal"] = {{"episodes", c.nominal.flights},
                     {"success_rate", or_null(if_flown(c.nominal, c.nominal.success.value))},
                     {"strict_rate", or_null(if_flown(c.nominal, c.nominal.strict.value))}};
  put_quantiles(json["nominal"], "time_to_strict", "s", c.nominal.strict_s);
  json["hash"] = io::hexadecimal(s.hash);
  return json;
}

Json json_of(const Request& request, const FlyConfig& config, const std::vector<Column>& columns) {
  Json json = {{"policy", request.policy},
               {"task", config.fleet.task.name},
               {"seed", request.seed},
               {"vehicles", request.stream},
               {"episodes_asked", request.episodes}};
  json.update(json_of(columns[0]));
  if (const auto& muscles = config.vehicle.jointed; muscles && muscles->muscle_mass_kg > 0)
    put_quantiles(json, "mean_muscle_power", "W_kg", columns[0].flights.power_W, 1 / muscles->muscle_mass_kg);
  json["pid_success_rate"] = json["arc_success_rate"] = nullptr;
  for (std::size_t i = 1; i < columns.size(); ++i) {
    const std::string name = i == 1 ? "pid" : "arc";
    json[name] = json_of(columns[i]);
    json[name + "_success_rate"] = json[name]["success_rate"];
  }
  if (config.fleet.task.name == "escape")
    json["reference"] = {{"hummingbird_s", kHummingbird_s}, {"study_optimum_s", kOptimum_s}};
  json["commit"] = io::commit();
  json["config"] = config.resolved;
  return json;
}

/// The controller of this name: that of the configuration where it is of this type, else the shipped one.
Controller controller_named(const std::string& name, const FlyConfig& config) {
  if (config.fleet.controller.kind == flight::controller_kind(name)) return config.fleet.controller;
  return flight::read_controller(io::Config::load(io::config_path("controllers/" + name + ".toml")).root(),
                                 config.fleet.control_hz);
}

/// The configuration with one effect of the catalogue at `magnitude` times its typical magnitudes, clamped to what a vehicle file accepts.
FlyConfig with_effect(FlyConfig config, const model::CatalogueEffect& effect, double magnitude) {
  auto& values = config.added_effects[effect.info.id];
  for (int i = 0; i < effect.info.magnitudes; ++i) {
    const model::EffectParameter& p = effect.parameters[static_cast<std::size_t>(i)];
    values[p.name] = std::clamp(magnitude * p.typical, p.low, p.high);
  }
  config.vehicle.effects[effect.info.id] = values;
  return config;
}

/// The lowest and the mean success over all effects that were flown, at one magnitude.
struct OverEffects {
  std::optional<double> worst, mean;
};
OverEffects over_effects(const Json& effects, std::size_t magnitude) {
  OverEffects over;
  double sum = 0, count = 0;
  for (const Json& effect : effects) {
    const Json& rate = effect.at("success").at(magnitude).at("rate");
    if (rate.is_null()) continue;
    over.worst = std::min(over.worst.value_or(1), rate.get<double>());
    sum += rate.get<double>(), count += 1;
  }
  if (count > 0) over.mean = sum / count;
  return over;
}

/// Evaluates the success of the policy with each effect, by magnitude; vehicles draw no other effects.
void evaluate_effects(const Request& request, FlyConfig config, const rollout::Agent& agent,
                      const io::Program& program) {
  config.drawn_effects.reset();
  const auto stream = request.stream == "test" ? rollout::kTestFlappers : rollout::kValidationFlappers;
  const rollout::EvaluationOptions options{.count = request.episodes, .first_flapper = stream, .ranks = request.ranks};
  io::ProgressLine progress("effects flown");
  double done = 0;
  bool over = false;  // the same on all ranks
  const auto fly = [&](const FlyConfig& flown) -> std::optional<Summary> {
    const rollout::Evaluation e = rollout::Evaluator(flown, options).fly(agent, rollout::Detail::success, [](double) {
      return !io::interrupted();
    });
    over |= e.stopped;
    if (e.stopped) return std::nullopt;
    return rollout::summarise(e.flights);
  };
  const std::vector<model::CatalogueEffect>& effects = model::catalogue_of(config.vehicle);
  const double all = static_cast<double>(effects.size() * request.magnitudes.size()) + 1;
  const auto without = fly(config);
  progress.show(++done / all);
  Json list = Json::array();
  std::vector<std::string> rows;
  const auto percent = [](const Number& share) { return share ? io::format("%8.1f", 100 * *share) : "       -"; };
  const auto share_of = [](const std::optional<Summary>& flown) {
    return flown ? Number(flown->success.value) : std::nullopt;
  };
  for (const model::CatalogueEffect& effect : effects) {
    std::string row;
    Json json = {{"effect", effect.info.id}, {"typical", Json::object()}, {"success", Json::array()}};
    for (int i = 0; i < effect.info.magnitudes; ++i) {
      const model::EffectParameter& p = effect.parameters[static_cast<std::size_t>(i)];
      json["typical"][p.name] = p.typical;
    }
    for (const double magnitude : request.magnitudes) {
      std::optional<Summary> flown;
      if (effect.info.id == std::string_view("tether") && !config.fleet.batch.world.has_ground())
        json["refused"] = "there is no ground to hang down to; accepted: world.ground_z_m";
      else if (!over) try {
          const FlyConfig with = with_effect(config, effect, magnitude);
          const flight::Fleet<float> one(1, with.vehicle, with.fleet);  // throws on all ranks alike
          flown = fly(with);
        } catch (const std::invalid_argument& refused) {  // the sensors do not allow such a delay
          json["refused"] = refused.what();
        }
      progress.show(++done / all);
      row += percent(share_of(flown));
      const auto figure = [&](auto value) { return flown ? Json(value()) : Json(nullptr); };
      json["success"].push_back({{"magnitude", magnitude},
                                 {"rate", figure([&] { return flown->success.value; })},
                                 {"low", figure([&] { return flown->success.low; })},
                                 {"high", figure([&] { return flown->success.high; })},
                                 {"hash", figure([&] { return io::hexadecimal(flown->hash); })}});
    }
    char name[64];
    std::snprintf(name, sizeof name, "  %-28s", effect.info.id);
    rows.push_back(name + row);
    list.push_back(json);
  }
  progress.clear();
  std::printf(
      "%s%zu flights each, task %s, seed %llu, %s vehicles: success, %%, by magnitude of an effect in units of its "
      "typical one\n",
      over ? "stopped; " : "", request.episodes, config.fleet.task.name.c_str(),
      static_cast<unsigned long long>(request.seed), request.stream.c_str());
  std::printf("  %-28s", "");
  for (const double magnitude : request.magnitudes) std::printf("%8g", magnitude);
  std::printf("\n  %-28s%s\n", "none", percent(share_of(without)).c_str());
  for (const std::string& row : rows) std::printf("%s\n", row.c_str());
  Json worst = Json::array(), mean = Json::array();
  std::string worst_row, mean_row;
  for (std::size_t m = 0; m < request.magnitudes.size(); ++m) {
    const OverEffects over_all = over_effects(list, m);
    worst.push_back(or_null(over_all.worst)), mean.push_back(or_null(over_all.mean));
    worst_row += percent(over_all.worst), mean_row += percent(over_all.mean);
  }
  std::printf("  %-28s%s\n  %-28s%s\n", "the worst of these effects", worst_row.c_str(), "their mean",
              mean_row.c_str());
  program.write_shown_json({{"policy", request.policy},
                            {"task", config.fleet.task.name},
                            {"seed", request.seed},
                            {"vehicles", request.stream},
                            {"episodes", request.episodes},
                            {"stopped", over},
                            {"success_rate", without ? Json(without->success.value) : Json(nullptr)},
                            {"hash", without ? Json(io::hexadecimal(without->hash)) : Json(nullptr)},
                            {"effects", list},
                            {"worst", worst},
                            {"mean", mean},
                            {"commit", io::commit()}});
}

void evaluate(Request request, io::Program& program) {
  const fs::path path = request.policy;
  const std::string kind = path.extension().string();
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    io::read_text(path);  // throws where the file is missing
    if (kind != ".json" && !policy::is_policy_file(path))
      throw io::InputError(request.policy + ": is no policy; accepted: " + kPolicies);
  }
  FlyConfig config = read_config(request);
  std::string agreed = "episodes: " + std::to_string(request.episodes) + "\n";
  if (const fs::path file = fs::is_directory(path) ? path / "best.json" : path; fs::exists(file))
    agreed += "policy: " + io::sha256(io::read_text(file)) + "\n";
  for (const auto& [name, text] : config.resolved) agreed += name + ": " + io::sha256(text) + "\n";
  request.ranks = program.ranks(agreed);
  if (program.writes()) config.watch = server::telemetry_of(config.dds, config.fleet.sensors);
  const flight::Task& task = config.fleet.task;
  std::unique_ptr<const policy::Policy> policy;
  if (policy::is_policy_file(path))
    policy = policy::load_policy(path, static_cast<int>(task.observation().size()), task.actions());
  if (request.effects) {
    io::stop_on_interrupt();
    return evaluate_effects(request, config, {policy ? nullptr : config.actor, policy.get()}, program);
  }
  std::vector<std::pair<const char*, Controller>> alone;
  // a controller cannot add to voltages, and the project's controllers are tuned to its own flappers
  if (!request.no_baselines && !task.sets_voltages() && !config.vehicle.beat_averaged && !config.vehicle.jointed)
    alone = {{"PID alone", controller_named("pid", config)}, {"ARC alone", controller_named("arc", config)}};

  Evaluation evaluation(request, config);
  io::stop_on_interrupt();
  std::vector<Column> columns;
  columns.push_back(evaluation.fly_policy({policy ? nullptr : config.actor, policy.get()}));
  for (const auto& [name, controller] : alone)
    if (!columns.back().stopped) columns.push_back(evaluation.fly_alone(name, controller));
  print(request, config, columns);
  program.write_shown_json(json_of(request, config, columns));
}

}  // namespace
}  // namespace flappy::eval

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-eval", "Flies a policy on randomised vehicles, and flies PID and ARC for comparison.",
                      {"instruction set " + sim::best_instruction_set(),
                       std::string("TorchScript ") + (policy::reads_torch_script() ? "yes" : "no")});
  const io::Command& app = program.app();
  eval::Request r;
  app.option("policy", r.policy, eval::kPolicies).required();
  app.option("--config", r.config, "how a single file flies: configs/fly/*.toml (escape); a run folder has its own");
  app.option("--vehicle", r.vehicle, "vehicle file instead");
  app.option("--task", r.task, "task file instead");
  app.option("--set", r.overrides, "override a key: task.hand_back.at_s=0.4").one_at_a_time();
  app.option("--episodes", r.episodes, "flights, each with vehicle, start and noise of its own")
      .range(1, 100'000)
      .shows_default();
  app.option("--seed", r.seed, "of vehicles, starts and noise")
      .range(std::uint64_t{0}, std::uint64_t{INT64_MAX})
      .shows_default();
  app.option("--stream", r.stream, "vehicles that training never saw: \"test\", or \"validation\"")
      .one_of({"test", "validation"})
      .shows_default();
  app.option("--threads", r.threads, "0: one for each processor").range(0, 1024).shows_default();
  app.flag("--no-baselines", r.no_baselines, "without PID and ARC");
  program.takes_ranks();
  const io::Option effects =
      app.flag("--effects", r.effects,
               "instead: success with each effect of the catalogue, at 0.5 to 2 times its typical magnitude");
  app.option("--magnitudes", r.magnitudes, "of those, in units of the typical ones: 1,1.5")
      .range(0.0, 10.0)
      .separated_by(',')
      .needs(effects);
  return program.run(argc, argv, [&] { eval::evaluate(r, program); });
}
