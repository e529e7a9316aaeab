#include "gap/diagnose/corrected_vehicle.hpp"

#include "model/posterior.hpp"

namespace flappy::gap {

model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Diagnosis& d,
                                 const sim::Randomisation& uncertain) {
  const ScoredHypothesis& best = flown(d);
  const Hypothesis h(uncertain, best.effects);
  const Fit& fit = best.kind == ScoredHypothesis::Kind::effect ? best.fit : d.parameters;
  model::Vehicle corrected = vehicle;
  if (best.kind != ScoredHypothesis::Kind::none) {
    const Eigen::VectorXd& mean = d.corrected;
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

}  // namespace flappy::gap
