#include "gap/next/expected_nats.hpp"

#include <algorithm>
#include <cmath>

#include "gap/answer/verdict.hpp"

namespace flappy::gap {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd expected_nats(const VectorXd& log_evidence, Index a) { return log_evidence[a] - log_evidence.array(); }

double expected_nats(const Evidence& evidence, const Expected& a, const Expected& b) {
  SufficientStatistics difference = b.residual;
  for (std::size_t f = 0; f < difference.sums.size(); ++f)
    for (std::size_t g = 0; g < difference.sums[f].size(); ++g) difference.sums[f][g] -= a.residual.sums[f][g];
  std::vector<const BasisCoefficients*> columns;
  std::vector<int> chosen;
  for (const BasisCoefficients& column : b.uncertain) {
    chosen.push_back(static_cast<int>(columns.size()));
    columns.push_back(&column);
  }
  const BasisCoefficients sd =
      (evidence.discrepancy_sd({}).array().square() + a.law_sd.array().square() + b.law_sd.array().square()).sqrt();
  const std::vector<char> all(difference.sums.size(), 1);
  Reduced reduced = evidence.reduce(difference, columns, all, sd);
  const auto log_evidence = [&] {
    return Evidence::posterior(reduced, chosen, VectorXd::Zero(static_cast<Index>(columns.size()))).log_evidence;
  };
  const double of_b = log_evidence();
  reduced.sums.rightCols(1).setZero();  // of what a predicts, a leaves nothing; its covariance counts as b's
  reduced.sums.bottomRows(1).setZero();
  return expected_nats(Eigen::Vector2d(log_evidence(), of_b), 0)[1];
}

double kept_odds(double nats, const VerdictRule& rule) { return tempered(std::max(0.0, nats), rule); }

double expected_information(const std::vector<double>& probability, const std::vector<double>& nats,
                            const VerdictRule& rule) {
  double sum = 0;
  for (std::size_t i = 0; i < probability.size(); ++i)
    sum -= probability[i] * std::log(probability[i] + (1 - probability[i]) * kept_odds(nats[i], rule));
  return sum;
}

}  // namespace flappy::gap
