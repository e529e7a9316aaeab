#include "gap/diagnose/corrected_vehicle.hpp"

#include "model/posterior.hpp"

namespace flappy::gap {

model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& d,
                                 const sim::Randomisation& uncertain) {
  const ScoredHypothesis& best = d.predicting();
  const Hypothesis h(uncertain, best.effects);
  const Fit& fit = best.kind == HypothesisKind::effect ? best.fit : d.parameters;
  model::Vehicle corrected = vehicle;
  if (best.kind != HypothesisKind::none) {
    const Eigen::VectorXd& mean = d.corrected;
    const Eigen::MatrixXd covariance = fit.covariance();
    std::vector<std::vector<double>> rows;
    for (const auto& row : covariance.rowwise()) rows.emplace_back(row.begin(), row.end());
    corrected = h.vehicle(mean).vehicle;
    corrected.posterior = model::posterior_of(
        [&](const std::vector<double>& at) {
          return h.vehicle(h.bounded(Eigen::Map<const Eigen::VectorXd>(at.data(), h.size()))).vehicle;
        },
        {mean.begin(), mean.end()}, rows);
  }
  corrected.name = vehicle.name + "_corrected";
  return corrected;
}

}  // namespace flappy::gap
