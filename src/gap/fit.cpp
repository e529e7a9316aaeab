#include "gap/fit.hpp"

#include <cmath>
#include <numeric>

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Of a coordinate, to either side: small against its prior, large against rounding.
constexpr double kDifference = 0.1;
/// Effects of one sign step to one side from 0.
constexpr double kSizeDifference = 0.2;
constexpr double kConverged = 0.02;
/// Nats that another linearisation has to bring.
constexpr double kWorthwhile = 0.05;

std::vector<char> all_of(std::size_t flights) { return std::vector<char>(flights, 1); }

}  // namespace

std::vector<Signature> Fitter::residuals(const std::vector<Candidate>& candidates) const {
  std::vector<Signature> list = predict_all(flights_, candidates, threads_);
  for (Signature& s : list)
    for (std::size_t f = 0; f < flights_.size(); ++f) {
      if (s[f].empty()) {
        s.clear();
        break;
      }
      for (std::size_t i = 0; i < s[f].size(); ++i) s[f][i] = flights_[f].measured()[i] - s[f][i];
    }
  return list;
}

Linearised Fitter::linearise(const Hypothesis& hypothesis, const VectorXd& at, const std::vector<Index>& which) const {
  std::vector<Candidate> candidates = {hypothesis.candidate(at)};
  struct Difference {
    Index coordinate;
    double span;
  };
  std::vector<Difference> differences;
  for (const Index i : which) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(i)];
    VectorXd up = at, down = at;
    up[i] += u.size ? kSizeDifference : kDifference;
    down[i] -= u.size ? kSizeDifference : kDifference;
    up = hypothesis.bounded(up);
    down = hypothesis.bounded(down);
    if (u.size && u.low >= 0 && at[i] < kSizeDifference) down = at;
    differences.push_back({i, up[i] - down[i]});
    candidates.push_back(hypothesis.candidate(up));
    candidates.push_back(hypothesis.candidate(down));
  }
  std::vector<Signature> rows = residuals(candidates);
  Linearised l{at, std::move(rows[0]), std::vector<Signature>(static_cast<std::size_t>(hypothesis.size()))};
  for (std::size_t d = 0; d < differences.size(); ++d) {
    Signature &up = rows[1 + 2 * d], &down = rows[2 + 2 * d];
    if (up.empty() || down.empty()) continue;
    for (std::size_t f = 0; f < up.size(); ++f)
      for (std::size_t i = 0; i < up[f].size(); ++i) up[f][i] = (down[f][i] - up[f][i]) / differences[d].span;
    l.columns[static_cast<std::size_t>(differences[d].coordinate)] = std::move(up);
  }
  return l;
}

double Fitter::cost(const Signature& residual, const VectorXd& at) const {
  const Reduced reduced = evidence_.reduce(evidence_.grams(residual, {}), all_of(flights_.size()), discrepancy_);
  return 0.5 * (reduced.sums(0, 0) + at.squaredNorm());
}

Fit Fitter::fit(const Hypothesis& hypothesis, VectorXd start, int iterations) const {
  Fit result;
  std::vector<Index> all(static_cast<std::size_t>(hypothesis.size()));
  std::iota(all.begin(), all.end(), Index{0});
  result.point = linearise(hypothesis, hypothesis.bounded(std::move(start)), all);
  if (result.point.residual.empty()) return result;  // comes apart
  for (result.iterations = 1;; ++result.iterations) {
    const Linearised& l = result.point;
    std::vector<const Signature*> columns;
    std::vector<int> chosen;
    std::vector<Index> coordinates;
    for (const Index i : all) {
      if (l.columns[static_cast<std::size_t>(i)].empty()) continue;
      chosen.push_back(static_cast<int>(columns.size()));
      columns.push_back(&l.columns[static_cast<std::size_t>(i)]);
      coordinates.push_back(i);
    }
    const Reduced reduced = evidence_.reduce(evidence_.grams(l.residual, columns), all_of(flights_.size()), discrepancy_);
    VectorXd prior_mean(static_cast<Index>(coordinates.size()));
    for (std::size_t i = 0; i < coordinates.size(); ++i) prior_mean[static_cast<Index>(i)] = -l.at[coordinates[i]];
    result.posterior = Evidence::posterior(reduced, chosen, prior_mean, VectorXd::Ones(prior_mean.size()));
    result.coordinates = coordinates;
    if (result.iterations >= iterations) return result;
    VectorXd step = VectorXd::Zero(l.at.size());
    for (std::size_t i = 0; i < coordinates.size(); ++i) step[coordinates[i]] = result.posterior.mean[static_cast<Index>(i)];
    if (step.cwiseAbs().maxCoeff() < kConverged) return result;
    // the longest share of the step that pays, all tried at once
    constexpr double kShares[] = {1, 0.5, 0.25, 0.1, 0.03};
    std::vector<VectorXd> tries;
    std::vector<Candidate> candidates;
    for (const double share : kShares) {
      tries.push_back(hypothesis.bounded(l.at + share * step));
      candidates.push_back(hypothesis.candidate(tries.back()));
    }
    const std::vector<Signature> residuals_there = residuals(candidates);
    const double before = cost(l.residual, l.at);
    std::size_t best = tries.size();
    double best_cost = before;
    for (std::size_t i = 0; i < tries.size(); ++i) {
      if (residuals_there[i].empty()) continue;
      const double c = cost(residuals_there[i], tries[i]);
      if (c < best_cost) best = i, best_cost = c;
    }
    if (best == tries.size() || before - best_cost < kWorthwhile) return result;
    Linearised next = linearise(hypothesis, tries[best], all);
    if (next.residual.empty()) return result;
    result.point = std::move(next);
  }
}

}  // namespace flappy::gap
