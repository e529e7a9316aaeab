#include "diagnose.hpp"

#include <cstdio>
#include <limits>

#include "diagnosis_files.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"
#include "model/posterior.hpp"
#include "summary.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

/// Probability of the second answer from which on a flight is looked for that tells it from the first.
constexpr double kLeastRival = 0.01;

struct Logs {
  std::vector<flight::FlightLog> logs;
  std::vector<DataFault> faults;
};

Logs read_logs(const DiagnoseCommand& command) {
  Logs r;
  for (const std::string& folder : command.flights) {
    r.logs.push_back(flight::read_flight_log(folder));
    const std::vector<DataFault> own = data_faults(r.logs.back(), folder);
    r.faults.insert(r.faults.end(), own.begin(), own.end());
  }
  return r;
}

Diagnosis diagnose_visibly(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain,
                           const DiagnoseCommand& command) {
  DiagnoseOptions options;
  options.threads = command.threads;
  options.withheld = command.withheld;
  io::ProgressLine line("diagnosing", std::numeric_limits<double>::infinity());
  options.progress = [&](double share, const std::string& what) {
    line.show(share, what);
    return !io::interrupted();
  };
  return diagnose(flights, uncertain, options);
}

/// The vehicle with what was concluded, and what remains uncertain of it.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Diagnosis& d, const Conclusion& conclusion,
                                 const sim::Randomisation& uncertain) {
  const Answer& best = d.answers[conclusion.answer];
  const Hypothesis h(uncertain, best.effects);
  const Fit& fit = best.kind == Answer::Kind::effect ? best.fit : d.parameters;
  model::Vehicle corrected = vehicle;
  if (best.kind != Answer::Kind::none) {
    const Eigen::VectorXd mean = h.bounded(fit.mean());
    const Eigen::MatrixXd covariance = fit.covariance();
    std::vector<std::vector<double>> rows;
    for (const auto& row : covariance.rowwise()) rows.emplace_back(row.begin(), row.end());
    corrected = h.candidate(mean).vehicle;
    corrected.posterior = model::posterior_of(
        [&](const std::vector<double>& at) {
          return h.candidate(h.bounded(Eigen::Map<const Eigen::VectorXd>(at.data(), h.size()))).vehicle;
        },
        {mean.begin(), mean.end()}, rows);
  }
  corrected.name = vehicle.name + "_corrected";
  return corrected;
}

std::vector<ClosedLoop> fly_both(const DiagnoseCommand& command, const std::vector<CarriedFlight>& flights,
                                 const model::Vehicle& nominal, const model::Vehicle& corrected) {
  const std::string pilot = command.manoeuvre.empty() ? FLAPPY_CONFIGS "/fly/hover.toml" : command.manoeuvre;
  ClosedLoopOptions options;
  options.own_path = !command.manoeuvre.empty();
  options.threads = command.threads;
  return predict_closed_loop(flights, nominal, corrected, flight::read_fly_config(pilot, {}), options);
}

std::optional<NextExperiment> next_experiment(const Diagnosis& d, const sim::Randomisation& uncertain, int threads) {
  if (d.answers.size() < 2 || d.answers[1].probability < kLeastRival) return std::nullopt;
  NextOptions options;
  options.threads = threads;
  const auto ranked = rank_experiments(d, uncertain, read_manoeuvres(FLAPPY_CONFIGS "/gap/experiments"), options);
  if (ranked.empty()) return std::nullopt;
  return ranked.front();
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
  Logs read = read_logs(command);
  if (!read.faults.empty()) {
    const Report report = report_of(command.flights, std::move(read.faults));
    for (const std::string& line : summary_of(report, command.out)) std::printf("%s\n", line.c_str());
    Json json = diagnosis_json(report);
    if (!out.empty()) io::write_atomically(out / "diagnosis.json", json.dump(2) + "\n");
    return json;
  }
  std::vector<CarriedFlight> flights;
  for (std::size_t f = 0; f < read.logs.size(); ++f)
    flights.emplace_back(Recording(command.flights[f], std::move(read.logs[f]), vehicle));
  const Diagnosis d = diagnose_visibly(flights, uncertain, command);
  Report report = report_of(command.flights, flights, uncertain, d);
  const model::Vehicle corrected = corrected_vehicle(vehicle, d, report.conclusion, uncertain);
  if (d.complete) {
    report.closed_loop = fly_both(command, flights, vehicle, corrected);
    report.next = next_experiment(d, uncertain, command.threads);
  }
  Json json = diagnosis_json(report);
  for (const std::string& line : summary_of(report, command.out)) std::printf("%s\n", line.c_str());
  if (out.empty()) return json;
  io::write_atomically(out / "diagnosis.json", json.dump(2) + "\n");
  io::write_atomically(out / "vehicle_corrected.toml",
                       "# Corrected by flappy-gap diagnose.\n" + model::vehicle_text(corrected));
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
