#include "diagnose.hpp"

#include <cstdio>
#include <limits>

#include "diagnosis_files.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"
#include "summary.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

/// Thrown out of a diagnosis by its progress.
struct Interrupted {};

/// The same flights under the nominal and the corrected vehicle in closed loop.
Json closed_loop_json() { return Json::array(); }

/// The manoeuvre that best separates the rivals left.
Json next_experiment_json() { return nullptr; }

std::vector<CarriedFlight> read_flights(const DiagnoseCommand& command, const model::Vehicle& vehicle) {
  std::vector<CarriedFlight> flights;
  for (const std::string& folder : command.flights)
    flights.emplace_back(Recording(folder, flight::read_flight_log(folder), vehicle));
  return flights;
}

Diagnosis diagnose_visibly(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain,
                           const DiagnoseCommand& command) {
  DiagnoseOptions options;
  options.threads = command.threads;
  options.withheld = command.withheld;
  io::ProgressLine line("diagnosing", std::numeric_limits<double>::infinity());
  options.progress = [&](double share, const std::string& what) {
    if (io::interrupted()) throw Interrupted();
    line.show(share, what);
  };
  return diagnose(flights, uncertain, options);
}

/// The vehicle with what was concluded.
std::string corrected_text(const model::Vehicle& vehicle, const Diagnosis& d, const Conclusion& conclusion,
                           const sim::Randomisation& uncertain) {
  const Answer& best = d.answers[conclusion.answer];
  const Hypothesis h(uncertain, best.effects);
  const Fit& fit = best.kind == Answer::Kind::effect ? best.fit : d.parameters;
  model::Vehicle corrected = vehicle;
  if (best.kind != Answer::Kind::none) corrected = h.candidate(h.bounded(fit.mean())).vehicle;
  corrected.name = vehicle.name + "_corrected";
  return "# Corrected by flappy-gap diagnose.\n" + model::vehicle_text(corrected);
}

}  // namespace

Json run_diagnose(const DiagnoseCommand& command) {
  const model::Vehicle vehicle = model::read_vehicle(command.vehicle);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(command.priors, {}).root());
  for (const std::string& id : command.withheld)
    if (model::effect_index(id.c_str()) < 0)
      throw io::InputError("command line: --withhold: no effect \"" + id +
                           "\"; accepted: identifiers of docs/effects.md");
  const std::filesystem::path out = command.out;
  if (!out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(out, error);
    if (error) throw io::InputError("--out: " + command.out + ": " + error.message() + "; accepted: a folder");
    { const io::AtomicFile refused_before_the_work(out / "diagnosis.json"); }
  }
  io::stop_on_interrupt();
  const std::vector<CarriedFlight> flights = read_flights(command, vehicle);
  Diagnosis d;
  try {
    d = diagnose_visibly(flights, uncertain, command);
  } catch (const Interrupted&) {
    throw io::InputError("interrupted: no diagnosis is written");
  }
  const Report report = report_of(command.flights, flights, uncertain, d);
  Json json = diagnosis_json(report);
  json["closed_loop"] = closed_loop_json();
  json["next_experiment"] = next_experiment_json();
  for (const std::string& line : summary_of(report, command.out)) std::printf("%s\n", line.c_str());
  if (out.empty()) return json;
  io::write_atomically(out / "diagnosis.json", json.dump(2) + "\n");
  io::write_atomically(out / "vehicle_corrected.toml", corrected_text(vehicle, d, report.conclusion, uncertain));
  write_tables(out, report);
  std::string files = "diagnosis.json, vehicle_corrected.toml, residuals.csv, candidates.csv, unexplained.csv";
  try {
    write_figures(out, report);
    files += ", residuals.svg, probabilities.svg";
  } catch (const io::InputError& e) {
    std::fprintf(stderr, "warning: %s\n", e.what());
  }
  std::printf("written to %s: %s\n", command.out.c_str(), files.c_str());
  return json;
}

}  // namespace flappy::gap
