#include "gap/diagnose/diagnose_command.hpp"

#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "flappy/vehicle_file.hpp"
#include "gap/diagnose/corrected_vehicle.hpp"
#include "gap/diagnose/diagnosis_files.hpp"
#include "gap/diagnose/summary.hpp"
#include "gap/replay/mean_prediction.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "io/installation.hpp"
#include "io/log.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

/// Probability of the second hypothesis from which on a flight is looked for that tells it from the first.
constexpr double kLeastRival = 0.01;
/// A file that knows a robot by the beat alone may lack many at once, and to fit another costs little.
constexpr int kMostMeanEffects = 8;

struct Logs {
  std::vector<flightlog::FlightLog> logs;
  std::vector<flightlog::DataFault> faults;
};

Logs read_logs(const DiagnoseCommand& command) {
  Logs r;
  for (const std::string& folder : command.flights) r.logs.push_back(flightlog::read_flight_log(folder));
  r.faults = data_faults(r.logs, command.flights);
  return r;
}

Diagnosis diagnose_visibly(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                           DiagnoseOptions options) {
  io::ProgressLine line("diagnosing");
  std::string noted;
  options.progress = [&](double share, const std::string& what) {
    if (std::exchange(noted, what) != what) io::log(io::LogLevel::info, what);
    line.show(share, what);
    return !io::interrupted();
  };
  return diagnose(flights, uncertain, options);
}

/// The files of a diagnosis.
constexpr const char *kJson = "diagnosis.json", *kVehicle = "vehicle_corrected.toml";
constexpr const char* kFiles[] = {kJson, kVehicle, "residuals.csv", "candidates.csv", "unexplained.csv"};

/// All but diagnosis.json, which is that too until what lies ahead is known; the names of the others.
std::string write_all(const std::filesystem::path& out, const Report& report,
                      const std::optional<model::Vehicle>& corrected) {
  io::write_atomically(out / kJson, diagnosis_json(report).dump(2) + "\n");
  if (corrected)
    io::write_atomically(out / kVehicle, "# Corrected by flappy-gap diagnose.\n" + model::vehicle_text(*corrected));
  write_tables(out, report);
  std::string names;
  for (const char* name : kFiles)
    if (name != kJson && std::filesystem::exists(out / name)) names += std::string(", ") + name;
  return names;
}

/// What is asked beside the diagnosis, read before the work.
struct Asked {
  model::Vehicle vehicle;
  sim::Randomisation uncertain;
  rollout::FlyConfig pilot;
  std::vector<Manoeuvre> manoeuvres;
  DiagnoseOptions options;
  std::vector<int> channels;
};

std::vector<int> read_channels(const DiagnoseCommand& command, bool by_the_beat) {
  if (!command.channels.empty() && !by_the_beat)
    throw io::InputError("--channels: is for a vehicle that is known by the beat; accepted: all channels of this one");
  std::vector<std::string> known;
  for (int channel = kTorqueX; channel <= kForceZ; ++channel) known.push_back(channel_name(channel));
  std::vector<int> list;
  for (const std::string& name : command.channels) {
    const auto at = std::ranges::find(known, name);
    if (at == known.end())
      throw io::InputError("--channels " + name + ": no such channel; accepted: " + io::joined(known) +
                           io::did_you_mean(name, known));
    list.push_back(static_cast<int>(at - known.begin()));
  }
  return list;
}

Asked read_asked(const DiagnoseCommand& command) {
  model::Vehicle vehicle = model::read_any_vehicle(command.vehicle);
  const bool by_the_beat = vehicle.beat_averaged.has_value();
  if (!by_the_beat) vehicle = model::read_vehicle_for_steps(command.vehicle, kHoldStep_s);
  if (!by_the_beat && !vehicle.effects.empty())
    io::Config::load(command.vehicle)
        .root()
        .fail("effects", "what is missing is asked of the vehicle as it was believed", "a vehicle without effects");
  std::vector<std::string> withheld;
  std::vector<std::string> ids;
  const std::vector<model::EffectEntry>& catalogue = model::catalogue_of(vehicle);
  for (const auto& effect : catalogue) ids.push_back(effect.info.id);
  for (const std::string& id : command.withheld) {
    if (model::find_effect(vehicle, id) == nullptr)
      throw io::InputError("--withhold " + id + ": no such effect; accepted: identifiers of docs/effects.md" +
                           io::did_you_mean(id, ids));
    for (std::string& member : model::whole_group(catalogue, id)) withheld.push_back(std::move(member));
  }
  flightlog::check_each_once(command.flights);
  rollout::FlyConfig pilot =
      rollout::read_fly_config(command.manoeuvre.empty() ? io::config_path("fly/hover.toml") : command.manoeuvre);
  if (pilot.fleet.task.sets_voltages())
    throw io::InputError(
        command.manoeuvre +
        ": is flown by voltages alone, but what is predicted is flown by a controller; accepted: a task "
        "whose action is of kind \"wing_beat\"");
  const auto default_of = [&](const std::string& given, const char* file) {
    return given.empty() ? std::filesystem::path(io::config_path(by_the_beat ? std::string("gap/beat_averaged/") + file
                                                                             : std::string("gap/") + file))
                         : std::filesystem::path(given);
  };
  return {vehicle,
          sim::read_randomisation(vehicle, io::Config::load(default_of(command.priors, "priors.toml")).root()),
          std::move(pilot),
          read_manoeuvres(io::config_path("gap/experiments")),
          {.threads = command.threads,
           .finalists = by_the_beat ? static_cast<int>(catalogue.size()) : DiagnoseOptions().finalists,
           .most_effects = by_the_beat ? kMostMeanEffects : DiagnoseOptions().most_effects,
           .withheld = withheld,
           .progress = {},
           .discrepancy = read_model_discrepancy(default_of(command.discrepancy, "model_discrepancy.toml")),
           .rule = read_verdict_rule(default_of(command.verdict, "verdict.toml"))},
          read_channels(command, by_the_beat)};
}

/// In closed loop, and what to fly next; each left out after Ctrl-C.
void look_ahead(const DiagnoseCommand& command, const Asked& asked, const std::vector<PredictedFlight>& flights,
                const Diagnosis& d, const model::Vehicle& corrected, Report& report) {
  io::ProgressLine line("looking ahead");
  if (io::interrupted() || asked.vehicle.beat_averaged) return;
  line.show(0, "flying in closed loop");
  ClosedLoopOptions closed;
  closed.own_path = !command.manoeuvre.empty();
  closed.threads = command.threads;
  report.closed_loop = predict_closed_loop(flights, asked.vehicle, corrected, asked.pilot, closed);
  if (io::interrupted() || d.hypotheses.size() < 2 || d.hypotheses[1].probability < kLeastRival) return;
  line.show(0.5, "weighing what to fly next");
  NextOptions next;
  next.threads = command.threads;
  next.discrepancy = asked.options.discrepancy;
  next.rule = asked.options.rule;
  const auto ranked = rank_experiments(d, asked.uncertain, asked.manoeuvres, next);
  if (!ranked.empty()) report.next = ranked.front();
}

}  // namespace

Json run_diagnose(const DiagnoseCommand& command) {
  Asked asked = read_asked(command);
  const std::filesystem::path out = command.out;
  if (!out.empty()) {
    io::make_folder(out);
    io::check_output(out / kJson);
    io::log_into(out);
  }
  io::stop_on_interrupt();
  Logs read = read_logs(command);
  const bool faulty = !read.faults.empty();
  std::vector<PredictedFlight> flights;
  for (std::size_t f = 0; !faulty && f < read.logs.size(); ++f)
    if (asked.vehicle.beat_averaged)
      flights.emplace_back(
          std::make_shared<MeanPrediction>(command.flights[f], std::move(read.logs[f]), asked.vehicle, asked.channels));
    else flights.emplace_back(Recording(command.flights[f], std::move(read.logs[f]), asked.vehicle));
  const Diagnosis d = faulty ? Diagnosis() : diagnose_visibly(flights, asked.uncertain, asked.options);
  if (!faulty) asked.uncertain.set_minors(d.minors);
  // of an earlier diagnosis nothing stays beside this one
  for (const char* name : kFiles)
    if (std::error_code error; !out.empty()) std::filesystem::remove(out / name, error);
  Report report = faulty ? report_of(command.flights, std::move(read.faults))
                         : report_of(command.flights, flights, asked.uncertain, d);
  std::string written = kJson;
  if (!faulty) {
    std::optional<model::Vehicle> corrected;
    if (d.complete) corrected = corrected_vehicle(asked.vehicle, d, asked.uncertain);
    if (!out.empty()) written += write_all(out, report, corrected);
    if (corrected) look_ahead(command, asked, flights, d, *corrected, report);
  }
  Json json = diagnosis_json(report);
  const auto print = [&](const std::string& line) {
    if (!command.quiet) std::printf("%s\n", line.c_str());
  };
  for (const std::string& line : summary_of(report, command.out)) print(line);
  io::log(io::LogLevel::info, faulty       ? "the flights' data have faults: no diagnosis"
                              : d.complete ? "diagnosed"
                                           : "stopped before every effect was weighed");
  if (out.empty()) return json;
  io::write_atomically(out / kJson, json.dump(2) + "\n");
  print("written to " + command.out + ": " + written);
  print(io::shown_by(command.out));
  return json;
}

}  // namespace flappy::gap
