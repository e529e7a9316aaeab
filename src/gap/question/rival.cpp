#include "gap/question/rival.hpp"

#include <cmath>

namespace flappy::gap {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Coordinates of a rival left open: the fitted parameters, and the root mean square of each magnitude.
VectorXd open_place(const Hypothesis& h, const Fit& fit, const VectorXd& parameters) {
  VectorXd at = fit.mean();
  at.head(h.shared()) = parameters;
  const MatrixXd covariance = fit.covariance();
  for (Index i = h.shared(); i < h.size(); ++i)
    if (h.unknowns()[static_cast<std::size_t>(i)].magnitude)
      at[i] = std::copysign(std::hypot(at[i], std::sqrt(covariance(i, i))), at[i]);
  return at;
}

}  // namespace

std::string name_of(const ScoredHypothesis& a) {
  if (a.kind == HypothesisKind::none) return "none";
  if (a.kind == HypothesisKind::parameters) return "parameters";
  std::string name;
  for (const std::string& e : a.effects) name += (name.empty() ? "" : "+") + e;
  return name;
}

Rival certain_rival(const ScoredHypothesis& a, const Hypothesis& h, const VectorXd& at) {
  return {name_of(a), a.probability, h, at, {MatrixXd(h.size(), 0), VectorXd(0)}, MatrixXd(0, 0), false};
}

Rival fitted_rival(const ScoredHypothesis& a, const Inference& d, const sim::Randomisation& uncertain) {
  const Hypothesis h(uncertain, a.effects);
  const Fit& fit = a.kind == HypothesisKind::parameters ? d.parameters : a.fit;
  const bool open = a.kind == HypothesisKind::effect && !a.fitted();
  const VectorXd at = open ? open_place(h, fit, d.parameters.mean()) : fit.mean();
  return {name_of(a), a.probability, h, at, fit.directions, fit.posterior.covariance, open};
}

/// Columns along a rival's directions for the shared parameters, from another rival's columns: spares simulations.
std::vector<SharedColumn> turned(const Fit& l, const Directions& directions, Index shared) {
  std::vector<SharedColumn> columns;
  const MatrixXd turn =
      l.directions.axes.topLeftCorner(shared, shared).transpose() * directions.axes.topLeftCorner(shared, shared);
  for (Index d = 0; d < shared; ++d) {
    BasisCoefficients sum;
    for (Index i = 0; i < shared; ++i) {
      const BasisCoefficients& column = l.columns[static_cast<std::size_t>(i)];
      if (column.size() == 0) continue;
      if (sum.size() == 0) sum = BasisCoefficients::Zero(column.rows(), column.cols());
      sum += turn(i, d) * column;
    }
    columns.emplace_back(std::move(sum));
  }
  return columns;
}

}  // namespace flappy::gap
