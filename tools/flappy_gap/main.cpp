// flappy-gap: what a flight log says, and whether it can be believed.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "blind/oracle.hpp"
#include "blind_make.hpp"
#include "blind_score.hpp"
#include "diagnose.hpp"
#include "flappy/vehicle_file.hpp"
#include "gap/check.hpp"
#include "gap/data_faults.hpp"
#include "io/config.hpp"
#include "io/program.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::warning:
      return "warning";
    case Verdict::not_tested:
      return "not tested";
  }
  return "";
}

void print(const StreamStatistics& s) {
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

/// What was found out of one flight.
struct Checked {
  flight::FlightHeader header;
  CheckReport report;
  std::vector<DataFault> faults;
};

void print(const std::string& folder, const Checked& checked) {
  const auto& [header, report, faults] = checked;
  std::printf("%s: %s, %g Hz\n", folder.c_str(), header.vehicle.c_str(), header.flapping_Hz);
  std::printf("  %-8s %9s %9s %9s %9s %12s %17s %10s\n", "stream", "samples", "s", "Hz", "declared", "longest ms",
              "missing", "jitter ms");
  for (const StreamStatistics& s : report.streams) print(s);
  for (const Finding& f : report.findings)
    std::printf("  %-18s %s: %s\n", f.check.c_str(), name_of(f.verdict), f.text.c_str());
  for (const DataFault& f : faults)
    std::printf("  forbids a diagnosis: %s:%zu: %s\n", f.file.c_str(), f.line, f.what.c_str());
}

Json to_json(const std::string& folder, const Checked& checked) {
  const auto& [header, report, faults] = checked;
  Json forbidding = Json::array();
  for (const DataFault& f : faults) forbidding.push_back({{"file", f.file}, {"line", f.line}, {"what", f.what}});
  Json streams = Json::array(), findings = Json::array();
  for (const StreamStatistics& s : report.streams)
    streams.push_back({{"name", s.name},
                       {"samples", s.samples},
                       {"duration_s", s.duration_s},
                       {"rate_hz", s.rate_hz},
                       {"declared_hz", s.declared_hz ? Json(*s.declared_hz) : Json(nullptr)},
                       {"longest_gap_s", s.longest_gap_s},
                       {"missing", s.declared_hz ? Json(s.missing) : Json(nullptr)},
                       {"jitter_s", s.jitter_s}});
  for (const Finding& f : report.findings) {
    Json values = Json::object();
    for (const auto& [name, value] : f.values) values[name] = value;
    findings.push_back({{"check", f.check}, {"verdict", name_of(f.verdict)}, {"text", f.text}, {"values", values}});
  }
  return {{"folder", folder},
          {"vehicle", header.vehicle},
          {"warnings", report.count(Verdict::warning)},
          {"not_tested", report.count(Verdict::not_tested)},
          {"streams", streams},
          {"findings", findings},
          {"data_faults", forbidding}};
}

Json check(const std::vector<std::string>& folders) {
  flight::check_each_once(folders);
  std::vector<Checked> checked;
  for (const std::string& folder : folders) {
    const flight::FlightLog log = flight::read_flight_log(folder);
    CheckReport report = check_flight(log);
    std::vector<DataFault> faults = data_faults(log, report, folder);
    checked.push_back({log.header, std::move(report), std::move(faults)});
  }
  Json flights = Json::array();
  std::size_t faults = 0, warnings = 0, not_tested = 0;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    print(folders[i], checked[i]);
    flights.push_back(to_json(folders[i], checked[i]));
    faults += checked[i].faults.size();
    warnings += checked[i].report.count(Verdict::warning);
    not_tested += checked[i].report.count(Verdict::not_tested);
  }
  std::printf("%zu readable, faults %zu, warnings %zu, not tested %zu\n", folders.size(), faults, warnings, not_tested);
  return {{"flights", flights}, {"faults", faults}, {"warnings", warnings}, {"not_tested", not_tested}};
}

}  // namespace
}  // namespace flappy::gap

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-gap", "What a flight log says of the difference between a robot and its model.", {});
  CLI::App* check =
      program.app().add_subcommand("check", "axes, units, clocks and dropouts of logs, without a diagnosis");
  std::vector<std::string> folders;
  check->add_option("flight", folders, "folders of flight logs")->required();
  CLI::App* diagnose = program.app().add_subcommand("diagnose", "what is missing in the model of a robot that flew");
  gap::DiagnoseCommand command;
  diagnose->add_option("--vehicle", command.vehicle, "the vehicle's file, as it was believed")->required();
  diagnose->add_option("--flights", command.flights, "folders of flight logs")->required();
  diagnose->add_option("--priors", command.priors, "what is uncertain of the vehicle")->capture_default_str();
  diagnose->add_option("--manoeuvre", command.manoeuvre,
                       "what was flown, as a configuration of flappy-fly; else the recorded paths, under its hover's");
  diagnose->add_option("--withhold", command.withheld, "entries that the catalogue is to lack");
  diagnose->add_option("--out", command.out, "folder for diagnosis.json, the corrected vehicle, tables and figures");
  diagnose->add_option("--threads", command.threads, "0: one for each processor")->check(CLI::Range(0, 1024));
  CLI::App* blind = program.app().add_subcommand("blind", "how often diagnoses of robots of another making are right");
  blind->require_subcommand(1);
  CLI::App* make = blind->add_subcommand("make", "flies the cases and seals what they are");
  gap::MakeCommand made;
  std::string set;
  make->add_option("--out", made.out, "folder for the cases")->required();
  make->add_option("--set", set, "development or reported: which seeds")
      ->check(CLI::IsMember({"development", "reported"}))
      ->required();
  make->add_option("--part", made.plan.parts, "these parts alone")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(gap::kParts), std::end(gap::kParts))));
  make->add_option("--cases", made.plan.at_most, "of each part at most")->check(CLI::Range(1, 1000));
  make->add_option("--vehicle", made.vehicle, "the robot as declared")->capture_default_str();
  make->add_option("--randomise", made.randomise, "what robots are drawn from")->capture_default_str();
  make->add_option("--detectable", made.detectable, "what the oracle found of every effect")->capture_default_str();
  make->add_option("--threads", made.threads, "0: one for each processor")->check(CLI::Range(0, 1024));
  CLI::App* score = blind->add_subcommand("score", "diagnoses every case, then opens the labels and compares");
  gap::ScoreCommand scored;
  score->add_option("folder", scored.folder, "of blind make")->required();
  score->add_option("--vehicle", scored.vehicle, "the robot as declared, where it is elsewhere now");
  score->add_option("--priors", scored.priors, "what is uncertain of the vehicle")->capture_default_str();
  score->add_option("--threads", scored.threads, "cases at a time; 0: one for each processor")
      ->check(CLI::Range(0, 1024));
  program.app().require_subcommand(1);
  return program.run(argc, argv, [&] {
    if (make->parsed()) {
      made.plan.reported = set == "reported";
      const sim::Randomisation uncertain =
          sim::read_randomisation(model::read_vehicle(made.vehicle), io::Config::load(command.priors, {}).root());
      made.true_values = [&](const blind::Case& c, const std::vector<blind::BlindEffect>& effects) {
        return blind::true_values(c, effects, uncertain, 1);
      };
      if (!gap::blind_make(made)) std::printf("stopped; what has flown stays: the same command goes on\n");
    } else if (score->parsed()) {
      const gap::Json scores = gap::blind_score(scored);
      if (!scores.is_null()) program.write_json(scores);
    } else if (check->parsed()) {
      program.write_json(gap::check(folders));
    } else {
      program.write_json(gap::run_diagnose(command));
    }
  });
}
