#include "benchmark/predict/predict.hpp"

#include <algorithm>

#include "benchmark/predict/baselines.hpp"
#include "flappy/vehicle_file.hpp"
#include "gap/diagnose/corrected_vehicle.hpp"
#include "gap/diagnose/next_experiment.hpp"
#include "gap/diagnose/report.hpp"
#include "io/config.hpp"

namespace flappy::benchmark {

bool abstains(const Prediction& p) { return p.kind == "group" || p.probability < 0.5; }

Prediction predict(const Question& q) {
  const model::Vehicle vehicle = model::read_vehicle(q.vehicle);
  sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(q.priors).root());
  std::vector<gap::PredictedFlight> flights;
  for (const std::filesystem::path& folder : q.flights) {
    flightlog::FlightLog log = flightlog::read_flight_log(folder);
    if (!data_faults(log, folder).empty())
      return {.kind = gap::kind_name(gap::Conclusion::Kind::data), .probability = 1};
    flights.emplace_back(gap::Recording(folder, std::move(log), vehicle));
  }
  gap::DiagnoseOptions options;
  options.threads = 1;
  options.withheld = q.withheld;
  options.discrepancy = gap::read_model_discrepancy(q.discrepancy);
  options.rule = gap::read_verdict_rule(q.verdict);
  const gap::Diagnosis d = diagnose(flights, uncertain, options);
  uncertain.set_minors(d.minors);
  const gap::Report r = verdict_report_of(flights, uncertain, d);
  Prediction p;
  model::Vehicle corrected = corrected_vehicle(vehicle, d, uncertain);
  corrected.posterior.reset();  // long, and nobody asks for it here
  p.corrected = model::vehicle_text(corrected);
  for (const gap::ScoredHypothesis& a : d.hypotheses)
    p.weights.push_back({kind_name(a.kind), a.effects,
                         a.kind == gap::ScoredHypothesis::Kind::effect && !a.terms.empty(), a.log_evidence,
                         a.log_prior});
  p.kind = r.conclusion.remainder ? "remainder" : gap::kind_name(r.conclusion.kind);
  if (!r.unexplained.empty()) p.where = Where{r.unexplained.front().channel, r.unexplained.front().regime};
  p.effects = r.conclusion.effects;
  p.probability = r.conclusion.probability;
  p.nominal = r.nominal;
  p.refit = r.refit;
  p.floor = r.noise_floor;
  for (const gap::Reported& c : r.candidates) {
    if (c.kind == gap::ScoredHypothesis::Kind::none) p.none = c.probability;
    if (c.kind == gap::ScoredHypothesis::Kind::parameters) p.parameters = c.probability;
    if (c.kind == gap::ScoredHypothesis::Kind::unknown) p.unknown = c.probability;
    if (c.kind != gap::ScoredHypothesis::Kind::effect) continue;
    FittedSet set{c.effects, c.probability, {}, c.loss, c.gain_sd};
    if (const auto same = std::ranges::find(p.sets, c.effects, &FittedSet::effects); same != p.sets.end()) {
      same->probability += c.probability;  // with something more beside it
      continue;
    }
    for (const gap::SizeEstimate& s : c.sizes) set.values[s.name] = {s.value, s.low, s.high};
    p.sets.push_back(std::move(set));
  }
  if (!q.experiments.empty() && abstains(p)) {
    const auto ranked =
        rank_experiments(d, uncertain, gap::read_manoeuvres(q.experiments),
                         {.threads = options.threads, .discrepancy = options.discrepancy, .rule = options.rule});
    if (!ranked.empty()) p.manoeuvre = ranked.front().manoeuvre;
  }
  if (q.baselines) {
    p.baselines = baselines(flights, uncertain, d, q.withheld, options.threads);
    p.features = features(flights, d);
  }
  return p;
}

}  // namespace flappy::benchmark
