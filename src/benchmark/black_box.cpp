#include "benchmark/black_box.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Ridges to choose from, as shares of the mean square of an example.
constexpr double kRidges[] = {0.01, 0.03, 0.1, 0.3, 1, 3, 10};
constexpr double kMinSd = 1e-6;

}  // namespace

BlackBox::BlackBox(const std::vector<Example>& examples) {
  const auto n = static_cast<Index>(examples.size()), d = static_cast<Index>(examples.front().features.size());
  std::set<std::string> names;
  for (const Example& e : examples) names.insert(e.effect);
  effects_.assign(names.begin(), names.end());
  MatrixXd x(n, d), y = MatrixXd::Zero(n, static_cast<Index>(effects_.size()));
  for (Index i = 0; i < n; ++i) {
    const Example& e = examples[static_cast<std::size_t>(i)];
    x.row(i) = Eigen::Map<const VectorXd>(e.features.data(), d).transpose();
    y(i, std::ranges::lower_bound(effects_, e.effect) - effects_.begin()) = 1;
  }
  const VectorXd mean = x.colwise().mean();
  x.rowwise() -= mean.transpose();
  VectorXd scale = (x.colwise().squaredNorm() / static_cast<double>(n)).cwiseSqrt();
  for (double& s : scale) s = s > kMinSd ? 1 / s : 0;
  x = x * scale.asDiagonal();
  const VectorXd offset = y.colwise().mean();
  y.rowwise() -= offset.transpose();
  // kernel form: fewer examples than features. A left-out example errs by alpha / (K + ridge)^-1_ii
  const MatrixXd products = x * x.transpose();
  const double size = products.trace() > 0 ? products.trace() / static_cast<double>(n) : 1;
  MatrixXd best;
  double least = std::numeric_limits<double>::infinity();
  for (const double ridge : kRidges) {
    const MatrixXd inverse =
        (products + ridge * size * MatrixXd::Identity(n, n)).ldlt().solve(MatrixXd::Identity(n, n));
    MatrixXd alpha = inverse * y;
    const double left_out = (inverse.diagonal().cwiseInverse().asDiagonal() * alpha).squaredNorm();
    if (left_out < least) least = left_out, best = std::move(alpha);
  }
  const MatrixXd weights = x.transpose() * best;
  mean_.assign(mean.begin(), mean.end());
  scale_.assign(scale.begin(), scale.end());
  offset_.assign(offset.begin(), offset.end());
  for (Index k = 0; k < weights.cols(); ++k) weights_.emplace_back(weights.col(k).begin(), weights.col(k).end());
}

std::vector<std::string> BlackBox::ranked(const std::vector<double>& features) const {
  std::vector<std::pair<double, std::string>> list;
  for (std::size_t k = 0; k < effects_.size(); ++k) {
    double sum = offset_[k];
    for (std::size_t i = 0; i < mean_.size(); ++i) sum += weights_[k][i] * (features[i] - mean_[i]) * scale_[i];
    list.emplace_back(sum, effects_[k]);
  }
  std::ranges::stable_sort(list, std::greater{}, &std::pair<double, std::string>::first);
  std::vector<std::string> names;
  for (auto& [sum, name] : list) names.push_back(std::move(name));
  return names;
}

}  // namespace flappy::benchmark
