#include "diagnose.hpp"

#include <cstdio>

#include "flappy/vehicle_file.hpp"
#include "gap/diagnose.hpp"
#include "io/config.hpp"

namespace flappy::gap {
namespace {

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

}  // namespace

nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command) {
  const model::Vehicle vehicle = model::read_vehicle(command.vehicle);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(command.priors, {}).root());
  std::vector<CarriedFlight> flights;
  for (const std::string& folder : command.flights)
    flights.emplace_back(Recording(folder, flight::read_flight_log(folder), vehicle));
  DiagnoseOptions options;
  options.withheld = command.withheld;
  const Diagnosis d = diagnose(flights, uncertain, options);
  for (const Answer& a : d.answers) {
    std::printf("%-11s %6.3f  evidence %10.1f held out %10.1f ", kind_name(a.kind), a.probability, a.log_evidence,
                a.log_held_out);
    for (const std::string& e : a.effects) std::printf(" %s", e.c_str());
    if (a.kind == Answer::Kind::effect) {
      const Hypothesis h(uncertain, a.effects);
      const Eigen::VectorXd mean = a.fit.mean();
      const Eigen::MatrixXd covariance = a.fit.covariance();
      for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
        const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
        std::printf(" %s %.3g+-%.2g", u.name.c_str(), u.value(mean[i]), u.scale * std::sqrt(covariance(i, i)));
      }
    }
    std::printf("\n");
  }
  return nlohmann::ordered_json::object();
}

}  // namespace flappy::gap
