#include "lab/benchmark/predict/predict.hpp"

#include "flappy/vehicle_file.hpp"
#include "gap/diagnose/diagnose.hpp"
#include "lab/benchmark/predict/rivals.hpp"

namespace flappy::benchmark {

bool abstains(const gap::Verdict& verdict) {
  return verdict.kind == gap::VerdictKind::group || verdict.probability < 0.5;
}

namespace {

/// The vehicle's file without its posterior, which is long and not scored.
std::string text_of(model::Vehicle vehicle) {
  vehicle.posterior.reset();
  return model::vehicle_text(vehicle);
}

}  // namespace

Prediction predict(const Question& q) {
  gap::DiagnosisSettings settings;
  settings.vehicle = q.vehicle;
  for (const std::filesystem::path& folder : q.flights) settings.flights.push_back(folder);
  for (const std::filesystem::path& folder : q.reference) settings.reference.push_back(folder);
  settings.priors = q.priors;
  settings.discrepancy = q.discrepancy;
  settings.verdict = q.verdict;
  settings.sessions = q.sessions;
  settings.withheld = q.withheld;
  settings.experiments = q.experiments;
  settings.threads = 1;
  const gap::DiagnosisRequest request = read_request(settings);
  gap::Diagnosed d = diagnose(request);
  if (!q.experiments.empty() && abstains(d.result.verdict)) propose_experiment(request, d);
  Prediction p;
  if (d.corrected) {
    p.corrected = text_of(*std::move(d.corrected));
    if (q.rivals) {
      p.rivals["best RMSE"] = best_rmse(d.flights, d.inference);
      p.rivals["largest residual"] = largest_residual(d.flights, d.inference);
      if (!q.reference.empty()) p.rivals["Hotelling"] = hotelling(d.flights);
    }
  }
  p.diagnosis = std::move(d.result);
  return p;
}

}  // namespace flappy::benchmark
