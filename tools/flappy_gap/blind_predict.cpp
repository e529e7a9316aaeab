#include "blind_predict.hpp"

#include <cmath>
#include <numeric>

#include "flappy/vehicle_file.hpp"
#include "gap/baselines.hpp"
#include "gap/report.hpp"
#include "io/config.hpp"

namespace flappy::gap {
namespace {

/// Of the difference of two means, from its scatter over blocks.
double sd_of_difference(const Losses& a, const Losses& b) {
  if (a.sum.size() != b.sum.size() || a.sum.size() < 2) return 0;
  const auto total = [](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); };
  const double rows = total(a.count), n = static_cast<double>(a.sum.size());
  const double mean = (total(a.sum) - total(b.sum)) / rows;
  double scatter = 0;
  for (std::size_t i = 0; i < a.sum.size(); ++i) {
    const double d = a.sum[i] - b.sum[i] - mean * a.count[i];
    scatter += d * d;
  }
  return std::sqrt(scatter * n / (n - 1)) / rows;
}

std::map<std::string, ScoredSize> estimates(const Answer& a, const sim::Randomisation& uncertain) {
  std::map<std::string, ScoredSize> values;
  for (const Size& s : sizes_of(a, uncertain)) values[s.name] = {s.value, s.low, s.high};
  return values;
}

}  // namespace

Prediction predict(const Question& q) {
  const model::Vehicle vehicle = model::read_vehicle(q.vehicle);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(q.priors).root());
  std::vector<CarriedFlight> flights;
  for (const std::filesystem::path& folder : q.flights) {
    flight::FlightLog log = flight::read_flight_log(folder);
    if (!data_faults(log, folder).empty()) return {.kind = kind_name(Conclusion::Kind::data), .probability = 1};
    flights.emplace_back(Recording(folder, std::move(log), vehicle));
  }
  DiagnoseOptions options;
  options.threads = 1;
  options.withheld = q.withheld;
  const Diagnosis d = diagnose(flights, uncertain, options);
  Prediction p;
  const Conclusion concluded = conclude(d.answers);
  p.kind = kind_name(concluded.kind);
  p.effects = concluded.effects;
  p.probability = concluded.probability;
  for (const Answer& a : d.answers) {
    if (a.kind == Answer::Kind::none) p.none = a.probability;
    if (a.kind == Answer::Kind::parameters) p.parameters = a.probability;
    if (a.kind == Answer::Kind::unknown) p.unknown = a.probability;
  }
  const Surroundings around = surroundings_of(flights, d.noise_sd);
  const Losses refit = losses_of(around, d.refit);
  p.nominal = losses_of(around, d.nominal).mean();
  p.refit = refit.mean();
  p.floor = huber_floor();
  for (const Answer& a : d.answers) {
    if (a.kind != Answer::Kind::effect) continue;
    FittedSet set{a.effects, a.probability, estimates(a, uncertain)};
    if (a.fitted()) {
      const Losses left = losses_of(around, a.left);
      set.left = left.mean();
      set.gain_sd = sd_of_difference(refit, left);
    }
    p.sets.push_back(std::move(set));
  }
  if (q.baselines) p.baselines = baselines(flights, uncertain, d, q.withheld, options.threads);
  return p;
}

}  // namespace flappy::gap
