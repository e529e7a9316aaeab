#include "gap/answer/corrected_vehicle.hpp"

#include "model/posterior.hpp"

namespace flappy::gap {

model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Inference& inference,
                                 sim::Randomisation uncertain) {
  uncertain.set_minors(inference.corrected.minors);
  const ScoredHypothesis& best = inference.predicting();
  const Hypothesis h(uncertain, inference.corrected.effects);
  const Fit& fit = best.kind == HypothesisKind::effect ? best.fit : inference.parameters;
  model::Vehicle corrected = vehicle;
  if (best.kind != HypothesisKind::none) {
    const Eigen::VectorXd& mean = inference.corrected.at;
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(h.size(), h.size());
    const Eigen::MatrixXd known = fit.covariance();
    covariance.topLeftCorner(known.rows(), known.cols()) = known;
    const auto at = [&](const Eigen::VectorXd& coordinates) { return h.vehicle(h.bounded(coordinates)).vehicle; };
    std::vector<std::vector<double>> rows;
    for (const auto& row : covariance.rowwise()) rows.emplace_back(row.begin(), row.end());
    corrected = at(mean);
    corrected.posterior = model::posterior_of(
        [&](const std::vector<double>& there) { return at(Eigen::Map<const Eigen::VectorXd>(there.data(), h.size())); },
        {mean.begin(), mean.end()}, rows);
  }
  corrected.name = vehicle.name + "_corrected";
  return corrected;
}

}  // namespace flappy::gap
