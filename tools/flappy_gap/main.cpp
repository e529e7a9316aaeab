// flappy-gap: checks, imports and diagnoses flight logs.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "check_flown.hpp"
#include "flightlog/check/check.hpp"
#include "flightlog/check/data_faults.hpp"
#include "gap/diagnose/diagnose_command.hpp"
#include "import_command.hpp"
#include "io/config.hpp"
#include "io/program.hpp"
#include "learn_command.hpp"
#include "mcap_command.hpp"
#include "model/effects/registry.hpp"
#include "plan_command.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(flightlog::Verdict verdict) {
  switch (verdict) {
    case flightlog::Verdict::ok:
      return "ok";
    case flightlog::Verdict::warning:
      return "warning";
    case flightlog::Verdict::not_tested:
      return "not tested";
  }
  return "";
}

void print(const flightlog::StreamStatistics& s) {
  std::printf("  %-8s %9zu %9.3f %9.2f", s.name.c_str(), s.samples, s.duration_s, s.rate_hz);
  if (s.declared_hz) std::printf(" %9.2f", *s.declared_hz);
  else std::printf(" %9s", "-");
  std::printf(" %12.2f", 1e3 * s.longest_gap_s);
  if (s.declared_hz)
    std::printf(" %9zu %5.2f %%", s.missing,
                100.0 * static_cast<double>(s.missing) / static_cast<double>(s.samples + s.missing));
  else std::printf(" %9s %7s", "-", "-");
  std::printf(" %10.3f\n", 1e3 * s.jitter_s);
}

/// The results of checking one flight.
struct Checked {
  flightlog::FlightHeader header;
  flightlog::CheckReport report;
  std::vector<flightlog::DataFault> faults;
};

void print(const std::string& folder, const Checked& checked) {
  const auto& [header, report, faults] = checked;
  const std::string beat = header.flapping_Hz > 0 ? ", " + io::shortest_digits(header.flapping_Hz) + " Hz" : "";
  std::printf("%s: %s%s\n", folder.c_str(), header.vehicle.c_str(), beat.c_str());
  std::printf("  %-8s %9s %9s %9s %9s %12s %17s %10s\n", "stream", "samples", "s", "Hz", "declared", "longest ms",
              "missing", "jitter ms");
  for (const flightlog::StreamStatistics& s : report.streams) print(s);
  for (const flightlog::Finding& f : report.findings)
    std::printf("  %-18s %s: %s\n", f.check.c_str(), name_of(f.verdict), f.text.c_str());
  for (const flightlog::DataFault& f : faults)
    std::printf("  forbids a diagnosis: %s:%zu: %s\n", f.file.c_str(), f.line, f.what.c_str());
}

Json to_json(const std::string& folder, const Checked& checked) {
  const auto& [header, report, faults] = checked;
  Json forbidding = Json::array();
  for (const flightlog::DataFault& f : faults)
    forbidding.push_back({{"file", f.file}, {"line", f.line}, {"what", f.what}});
  Json streams = Json::array(), findings = Json::array();
  for (const flightlog::StreamStatistics& s : report.streams)
    streams.push_back({{"name", s.name},
                       {"samples", s.samples},
                       {"duration_s", s.duration_s},
                       {"rate_hz", s.rate_hz},
                       {"declared_hz", s.declared_hz ? Json(*s.declared_hz) : Json(nullptr)},
                       {"longest_gap_s", s.longest_gap_s},
                       {"missing", s.declared_hz ? Json(s.missing) : Json(nullptr)},
                       {"jitter_s", s.jitter_s}});
  for (const flightlog::Finding& f : report.findings) {
    Json values = Json::object();
    for (const auto& [name, value] : f.values) values[name] = value;
    findings.push_back({{"check", f.check}, {"verdict", name_of(f.verdict)}, {"text", f.text}, {"values", values}});
  }
  return {{"folder", folder},
          {"vehicle", header.vehicle},
          {"warnings", report.count(flightlog::Verdict::warning)},
          {"not_tested", report.count(flightlog::Verdict::not_tested)},
          {"streams", streams},
          {"findings", findings},
          {"data_faults", forbidding}};
}

Json check(const std::vector<std::string>& folders) {
  flightlog::check_each_once(folders);
  std::vector<flightlog::FlightLog> logs;
  for (const std::string& folder : folders) logs.push_back(flightlog::read_flight_log(folder));
  std::vector<flightlog::CheckReport> reports = check_flights(logs);
  std::vector<Checked> checked;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    std::vector<flightlog::DataFault> faults = data_faults(logs[i], reports[i], folders[i]);
    checked.push_back({logs[i].header, std::move(reports[i]), std::move(faults)});
  }
  Json flights = Json::array();
  std::size_t faults = 0, warnings = 0, not_tested = 0;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    print(folders[i], checked[i]);
    flights.push_back(to_json(folders[i], checked[i]));
    faults += checked[i].faults.size();
    warnings += checked[i].report.count(flightlog::Verdict::warning);
    not_tested += checked[i].report.count(flightlog::Verdict::not_tested);
  }
  std::printf("%zu readable, faults %zu, warnings %zu, not tested %zu\n", folders.size(), faults, warnings, not_tested);
  return {{"flights", flights}, {"faults", faults}, {"warnings", warnings}, {"not_tested", not_tested}};
}

/// Prints the catalogue of effects as a Markdown table, one row a parameter, and returns it as JSON.
Json list_effects(bool beat_averaged) {
  model::Vehicle vehicle;
  if (beat_averaged) vehicle.beat_averaged.emplace();
  Json all = Json::array();
  std::printf("| effect | stage | parameter | role | typical | accepted | 90 %% of the prior | group | source |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const model::CatalogueEffect& e : model::catalogue_of(vehicle)) {
    Json parameters = Json::array();
    const std::string group = *e.info.group == '\0' ? "-" : e.info.group;
    for (std::size_t k = 0; k < e.parameters.size(); ++k) {
      const model::EffectParameter& p = e.parameters[k];
      const char* role = static_cast<int>(k) < e.info.magnitudes ? "magnitude" : "shape";
      std::printf("| %s | %s | `%s` | %s | %g | %g to %g | %g to %g | %s | %s |\n", e.info.id, name_of(e.info.stage),
                  p.name, role, p.typical, p.low, p.high, p.prior_low, p.prior_high, group.c_str(), e.info.source);
      parameters.push_back({{"name", p.name},
                            {"role", role},
                            {"typical", p.typical},
                            {"low", p.low},
                            {"high", p.high},
                            {"prior_low", p.prior_low},
                            {"prior_high", p.prior_high}});
    }
    all.push_back({{"effect", e.info.id},
                   {"stage", name_of(e.info.stage)},
                   {"group", e.info.group},
                   {"source", e.info.source},
                   {"parameters", parameters}});
  }
  return {{"effects", all}};
}

}  // namespace
}  // namespace flappy::gap

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-gap", "What a flight log says of the difference between a robot and its model.", {});
  io::Command check = program.app().command(
      "check", "axes, units, clocks and dropouts of logs; exit code 1 where a fault forbids a diagnosis");
  std::vector<std::string> folders;
  std::string exported;
  check.option("flight", folders, "folders of flight logs").required();
  check.option("--flown", exported,
               "what flappy-export wrote, or a run folder: whether the robot flew it; exit code 1 where it did not");
  io::Command import =
      program.app().command("import", "makes a flight log of a bag (MCAP, SQLite), a ULog, or CSV files");
  gap::ImportCommand import_command;
  import.option("file", import_command.files, "a bag or its folder, a ULog, a CSV; several are one recording")
      .required();
  import.option("--mapping", import_command.mapping, "which channels become which streams: configs/mapping/*.toml")
      .required();
  import.option("--out", import_command.out, "folder of the flight log").required();
  import.option("--set", import_command.overrides, "override a key of the mapping: mocap.time=received")
      .one_at_a_time();
  io::Command diagnose = program.app().command(
      "diagnose", "what is missing in the model of a robot that flew; exit code 1 where the data forbid a diagnosis");
  gap::DiagnoseCommand command;
  diagnose.option("--vehicle", command.settings.vehicle, "the vehicle's file, as it was believed").required();
  diagnose.option("--flights", command.settings.flights, "folders of flight logs").required();
  diagnose.option("--reference", command.settings.reference,
                  "flights of the same robot before what --flights are asked about; NAME=LOG begins another set, "
                  "which is asked about, too");
  const auto takes_constants = [](io::Command& to, auto& settings) {
    to.option("--sessions", settings.sessions,
              "what differs between sessions [session_variation.toml, of a bench alone bench_session_variation.toml]");
    to.option("--priors", settings.priors, "what is uncertain of the vehicle [configs/gap/priors.toml, as the next]");
    to.option("--discrepancy", settings.discrepancy, "what every model gets wrong [model_discrepancy.toml]");
    to.option("--verdict", settings.verdict, "constants of the verdict [verdict.toml]");
  };
  takes_constants(diagnose, command.settings);
  diagnose.option("--manoeuvre", command.settings.manoeuvre,
                  "what was flown, as a configuration of flappy-fly; else the recorded paths, under its hover's");
  diagnose.option("--channels", command.settings.channels,
                  "of a beat-averaged vehicle: only these, as specific_force_x");
  diagnose.option("--withhold", command.settings.withheld, "effects to leave out of the catalogue");
  std::string software;
  diagnose.option("--flown", software,
                  "what flappy-export wrote, or a run folder: diagnose only if the robot flew it in all flights");
  diagnose.option("--out", command.out, "folder for diagnosis.json and the corrected vehicle");
  diagnose.option("--threads", command.settings.threads, "0: one for each processor").range(0, 1024);
  io::Command mcap =
      program.app().command("mcap", "a diagnosed flight and its predictions for Foxglove and PlotJuggler");
  std::string flight, declared, diagnosis, topics;
  mcap.option("flight", flight, "folder of the flight log").required();
  mcap.option("--vehicle", declared, "the vehicle's file, as it was diagnosed").required();
  mcap.option("--diagnosis", diagnosis, "folder that flappy-gap diagnose wrote").required();
  mcap.option("--out", topics, "file for the topics, X.mcap; layouts are written with it").required();
  io::Command plan = program.app().command("plan", "before any flight: which effects flights could tell apart");
  gap::PlanCommand planned;
  plan.option("--vehicle", planned.settings.vehicle, "the vehicle's file, as it is believed").required();
  const io::Option like = plan.option("--like", planned.settings.like,
                                      "flight logs whose inputs and paths are flown, in place of --manoeuvre");
  plan.option("--manoeuvre", planned.settings.manoeuvre, "what is flown, by its name in --experiments")
      .excludes(like)
      .shows_default();
  plan.option("--experiments", planned.settings.experiments, "folder of manoeuvres [configs/gap/experiments]")
      .excludes(like);
  plan.option("--sensors", planned.settings.sensors, "file of the sensors; else the manoeuvres'").excludes(like);
  plan.option("--flights", planned.settings.flights, "number of flights").range(1, 100).excludes(like).shows_default();
  plan.option("--duration", planned.settings.duration_s, "of a flight at most, s")
      .range(2.0, 600.0)
      .excludes(like)
      .shows_default();
  plan.flag("--reference", planned.settings.reference, "with as many reference flights of the same robot");
  takes_constants(plan, planned.settings);
  plan.option("--work", planned.settings.work, "hours of work of each choice [configs/gap/plan_work.toml]");
  plan.option("--magnitude", planned.magnitudes, "EFFECT=FACTOR on the typical magnitude");
  plan.option("--out", planned.out, "folder for plan.json and matrix.csv");
  plan.option("--threads", planned.settings.threads, "0: one for each processor").range(0, 1024);
  io::Command learn = program.app().command(
      "learn-discrepancy", "what models get wrong, from robots of which all is known that the vehicle's file says");
  gap::LearnCommand lessons{.vehicle = {},
                            .priors = io::config_path("gap/priors.toml"),
                            .discrepancy = io::config_path("gap/model_discrepancy.toml"),
                            .sessions = io::config_path("gap/session_variation.toml")};
  learn.option("--vehicle", lessons.vehicle, "the vehicle's file").required();
  learn.option("--robots", lessons.robots, "folders, each with the flights of one robot");
  learn.option("--pairs", lessons.pairs,
               "REFERENCE:TEST, two sessions of a robot without any change that matters, or REFERENCE:TEST:EFFECT, "
               "with this one");
  learn.option("--sessions", lessons.sessions, "of --pairs: to begin with").shows_default();
  learn.option("--priors", lessons.priors, "what is uncertain of the vehicle").shows_default();
  learn.option("--discrepancy", lessons.discrepancy, "to begin with").shows_default();
  learn.option("--out", lessons.out, "file for what is learnt").required();
  learn.option("--threads", lessons.threads, "0: one for each processor").range(0, 1024);
  io::Command scatter = program.app().command(
      "learn-sessions", "how much sessions of beat-averaged robots differ, from robots to which nothing was done");
  gap::LearnSessionsCommand normal{
      .robots = {}, .sessions = io::config_path("gap/beat_averaged/session_scatter.toml"), .out = {}};
  scatter
      .option("--robots", normal.robots, "VEHICLE.toml:DIR, its flights; VEHICLE.toml:DIR:DIR, of several manoeuvres")
      .required();
  scatter.option("--sessions", normal.sessions, "to begin with").shows_default();
  scatter.option("--out", normal.out, "file for what is learnt").required();
  scatter.option("--threads", normal.threads, "0: one for each processor").range(0, 1024);
  io::Command effects = program.app().command("effects", "lists the catalogue of effects: parameters, ranges, sources");
  bool beat_averaged = false;
  effects.flag("--beat-averaged", beat_averaged, "of a beat-averaged vehicle");
  program.app().expect_commands(1, 1);
  bool faulty = false;
  const int code = program.run(argc, argv, [&] {
    if (check.given() && !exported.empty()) {
      const nlohmann::ordered_json found = gap::check_flown(exported, folders);
      faulty = !found["as_exported"];
      program.write_json(found);
    } else if (check.given()) {
      const nlohmann::ordered_json found = gap::check(folders);
      faulty = found["faults"] > 0;
      program.write_json(found);
    } else if (effects.given()) {
      program.write_json(gap::list_effects(beat_averaged));
    } else if (import.given()) {
      program.write_json(gap::run_import(import_command));
    } else if (mcap.given()) {
      program.write_json(gap::run_mcap({flight, declared, diagnosis, topics}));
    } else if (plan.given()) {
      program.write_json(gap::run_plan(planned));
    } else if (scatter.given()) {
      program.write_json(gap::run_learn_sessions(normal));
    } else if (learn.given()) {
      gap::run_learn_discrepancy(lessons);
      program.write_json({{"out", lessons.out}});
    } else {
      if (!software.empty()) {
        std::vector<std::string> all = command.settings.flights;
        for (const gap::NamedFlights& set : gap::sets_of(command.settings.reference))
          all.insert(all.end(), set.flights.begin(), set.flights.end());
        const nlohmann::ordered_json found = gap::check_flown(software, all);
        faulty = !found["as_exported"];
        if (faulty) {
          std::printf("nothing is diagnosed: what flew is not what was exported\n");
          program.write_json({{"flown", found}});
          return;
        }
      }
      const nlohmann::ordered_json found = gap::run_diagnose(command);
      faulty = found["verdict"]["kind"] == "data";
      program.write_json(found);
    }
  });
  return faulty ? 1 : code;
}
