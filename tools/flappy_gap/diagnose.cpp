#include "diagnose.hpp"

#include <cmath>
#include <cstdio>

#include "flappy/vehicle_file.hpp"
#include "gap/diagnose.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kHalf90 = 1.645;
constexpr std::size_t kShown = 6;

const char* kind_name(Answer::Kind kind) {
  switch (kind) {
    case Answer::Kind::none:
      return "none";
    case Answer::Kind::parameters:
      return "parameters";
    case Answer::Kind::effect:
      return "effect";
    case Answer::Kind::unknown:
      return "unknown";
  }
  return "";
}

/// Of the effects' parameters: most probable value and 90 % interval.
Json effect_values(const Answer& a, const sim::Randomisation& uncertain) {
  Json values = Json::object();
  if (a.kind != Answer::Kind::effect) return values;
  const Hypothesis h(uncertain, a.effects);
  const Eigen::VectorXd mean = a.fit.mean();
  const Eigen::MatrixXd covariance = a.fit.covariance();
  for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    const double reach = kHalf90 * std::sqrt(covariance(i, i));
    values[u.effect + "." + u.name] = {
        {"value", u.value(mean[i])}, {"low", u.value(mean[i] - reach)}, {"high", u.value(mean[i] + reach)}};
  }
  return values;
}

void print(const Answer& a, const sim::Randomisation& uncertain) {
  std::printf("  %6.3f  %-10s", a.probability, kind_name(a.kind));
  for (const std::string& e : a.effects) std::printf(" %s", e.c_str());
  std::printf("\n");
  const Json values = effect_values(a, uncertain);
  for (const auto& [name, v] : values.items())
    std::printf("            %s %.3g (%.3g to %.3g)\n", name.c_str(), v["value"].get<double>(), v["low"].get<double>(),
                v["high"].get<double>());
}

}  // namespace

Json run_diagnose(const DiagnoseCommand& command) {
  const model::Vehicle vehicle = model::read_vehicle(command.vehicle);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(command.priors, {}).root());
  std::vector<CarriedFlight> flights;
  for (const std::string& folder : command.flights)
    flights.emplace_back(Recording(folder, flight::read_flight_log(folder), vehicle));
  for (const std::string& id : command.withheld)
    if (model::effect_index(id.c_str()) < 0)
      throw io::InputError("command line: --withhold: no effect \"" + id +
                           "\"; accepted: identifiers of docs/effects.md");
  DiagnoseOptions options;
  options.threads = command.threads;
  options.withheld = command.withheld;
  const Diagnosis d = diagnose(flights, uncertain, options);
  std::printf("probability  what explains the flights, and how large it is (90 %% interval)\n");
  Json answers = Json::array();
  for (std::size_t i = 0; i < d.answers.size(); ++i) {
    const Answer& a = d.answers[i];
    if (i < kShown) print(a, uncertain);
    answers.push_back({{"kind", kind_name(a.kind)},
                       {"effects", a.effects},
                       {"probability", a.probability},
                       {"log_evidence", a.log_evidence},
                       {"parameters", effect_values(a, uncertain)}});
  }
  if (!command.out.empty()) {
    const Answer& best = d.answers.front();
    const Hypothesis h(uncertain, best.effects);
    const Fit& fit = best.kind == Answer::Kind::effect ? best.fit : d.parameters;
    model::Vehicle corrected = vehicle;
    if (best.kind != Answer::Kind::none) corrected = h.candidate(h.bounded(fit.mean())).vehicle;
    corrected.name = vehicle.name + "_corrected";
    std::filesystem::create_directories(command.out);
    io::write_atomically(std::filesystem::path(command.out) / "vehicle_corrected.toml",
                         "# Corrected by flappy-gap diagnose.\n" + model::vehicle_text(corrected));
  }
  return {{"schema", 1}, {"flights", command.flights}, {"answers", answers}};
}

}  // namespace flappy::gap
