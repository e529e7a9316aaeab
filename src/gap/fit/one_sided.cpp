#include "gap/fit/one_sided.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Below -kFar an asymptotic series replaces erfc.
constexpr double kFar = 10 * std::numbers::sqrt2;

/// Mean by which conditioning X ~ N(t, 1) on X > 0 moves X: phi(t) / Phi(t).
double mean_above(double t) {
  if (t < -kFar) return -t / (1 - 1 / (t * t) + 3 / std::pow(t, 4));
  return std::exp(-0.5 * t * t) / (std::sqrt(std::numbers::pi / 2) * std::erfc(-t / std::numbers::sqrt2));
}

}  // namespace

double log_twice_positive(double mean, double sd) {
  const double t = mean / sd, x = -t / std::numbers::sqrt2;
  if (t > -kFar) return std::log(std::erfc(x));
  // Abramowitz, Stegun 7.1.23
  return -x * x - std::log(x * std::sqrt(std::numbers::pi)) + std::log1p(-1 / (2 * x * x));
}

OneSided one_sided(const Hypothesis& hypothesis, VectorXd mean, Eigen::MatrixXd covariance) {
  std::vector<Index> open;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(i)];
    if (u.one_sided()) open.push_back(i);
  }
  double log_factor = 0;
  while (!open.empty()) {
    const auto above = [&](Index i) {
      return mean[i] - hypothesis.unknowns()[static_cast<std::size_t>(i)].coordinate(0);
    };
    const auto worst = std::ranges::min_element(
        open, {}, [&](Index i) { return above(i) / std::sqrt(std::max(covariance(i, i), 1e-30)); });
    const Index i = *worst;
    open.erase(worst);
    if (!(covariance(i, i) > 0)) continue;  // known
    const double sd = std::sqrt(covariance(i, i)), t = above(i) / sd, moved = mean_above(t);
    const VectorXd column = covariance.col(i) / sd;
    log_factor += log_twice_positive(t, 1);
    mean += moved * column;
    covariance -= moved * (moved + t) * column * column.transpose();
  }
  return {log_factor, std::move(mean)};
}

}  // namespace flappy::gap
