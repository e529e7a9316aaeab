#include "identify/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flappy::identify {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kMinGain = 1e-7;   // least relative gain of an iteration
constexpr double kMinCost = 1e-16;  // relative to the initial cost: residuals in the eighth digit

double cost_of(const Eigen::VectorXd& residuals) {
  const double cost = residuals.squaredNorm();
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

/// A damped step of the parameters that the gradient does not push against a bound, clamped to the bounds.
Eigen::VectorXd stepped(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, const Eigen::VectorXd& point,
                        double damping) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < point.size(); ++i)
    if (!(point[i] <= 0 && gradient[i] > 0) && !(point[i] >= 1 && gradient[i] < 0)) free.push_back(i);
  Eigen::MatrixXd a = normal(free, free);
  // A small constant keeps the matrix regular for parameters without slope.
  a.diagonal() += damping * a.diagonal() + Eigen::VectorXd::Constant(a.rows(), 1e-12 * normal.trace() + 1e-300);
  const Eigen::VectorXd step = a.ldlt().solve(gradient(free));
  Eigen::VectorXd next = point;
  for (std::size_t i = 0; i < free.size(); ++i)
    next[free[i]] = std::clamp(point[free[i]] - step[static_cast<Eigen::Index>(i)], 0.0, 1.0);
  return next;
}

}  // namespace

Eigen::MatrixXd first_steps(Eigen::Index size) { return kDifference * Eigen::MatrixXd::Identity(size, size); }

Eigen::MatrixXd steps_along(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& point, double noise) {
  Eigen::MatrixXd steps = first_steps(point.size());
  std::vector<Eigen::Index> inner;  // parameters at a bound keep their own, one-sided step
  for (Eigen::Index i = 0; i < point.size(); ++i)
    if (point[i] >= kDifference && point[i] <= 1 - kDifference) inner.push_back(i);
  if (inner.empty()) return steps;
  const Eigen::MatrixXd among = slopes(Eigen::all, inner);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(among, Eigen::ComputeThinV);
  if (svd.matrixV().cols() < among.cols()) return steps;
  for (std::size_t k = 0; k < inner.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd way = svd.matrixV().col(column);
    double far = std::clamp(noise / std::max(svd.singularValues()[column], 1e-300), kDifference, kFarthest);
    for (std::size_t i = 0; i < inner.size(); ++i) {
      const double room = std::min(point[inner[i]], 1 - point[inner[i]]);
      far = std::min(far, room / std::max(std::abs(way[static_cast<Eigen::Index>(i)]), 1e-300));
    }
    steps(inner, inner[k]) = far * way;
  }
  return steps;
}

Eigen::MatrixXd jacobian(const Residuals& residuals, const Eigen::VectorXd& point, const Eigen::MatrixXd& steps) {
  std::vector<Eigen::VectorXd> points;
  Eigen::MatrixXd apart(point.size(), steps.cols());
  for (Eigen::Index i = 0; i < steps.cols(); ++i) {
    for (const double way : {-1.0, 1.0}) points.emplace_back((point + way * steps.col(i)).cwiseMax(0).cwiseMin(1));
    apart.col(i) = points.back() - points[points.size() - 2];
  }
  const std::vector<Eigen::VectorXd> r = residuals(points);
  Eigen::MatrixXd differences(r.front().size(), steps.cols());
  for (Eigen::Index i = 0; i < steps.cols(); ++i) {
    const auto low = static_cast<std::size_t>(2 * i);
    differences.col(i) = r[low + 1] - r[low];
  }
  return apart.transpose().partialPivLu().solve(differences.transpose()).transpose();
}

LeastSquares minimise(const Residuals& residuals, const Eigen::VectorXd& start,
                      const std::function<bool(const LeastSquares&)>& more) {
  Eigen::VectorXd r = residuals({start}).front();
  LeastSquares best{start, cost_of(r), 0, 1};
  const double enough = kMinCost * best.cost;
  double damping = 1e-3;
  Eigen::MatrixXd steps = first_steps(start.size());
  int without_gain = 0;
  while (best.cost > enough && best.iterations < kMaxIterations && without_gain < 2 && (!more || more(best))) {
    ++best.iterations;
    const Eigen::MatrixXd j = jacobian(residuals, best.point, steps);
    best.evaluations += 2 * static_cast<std::size_t>(start.size());
    if (!j.allFinite()) break;
    steps = steps_along(j, best.point, std::sqrt(best.cost / static_cast<double>(r.size())));
    const Eigen::MatrixXd normal = j.transpose() * j;
    const Eigen::VectorXd gradient = j.transpose() * r;
    const std::vector<double> factors = {0, 1e-2, 1, 1e1, 1e2, 1e4};
    std::vector<Eigen::VectorXd> points;
    for (const double factor : factors) points.push_back(stepped(normal, gradient, best.point, factor * damping));
    const std::vector<Eigen::VectorXd> tried = residuals(points);
    best.evaluations += points.size();
    std::size_t lowest = 0;
    for (std::size_t i = 1; i < tried.size(); ++i)
      if (cost_of(tried[i]) < cost_of(tried[lowest])) lowest = i;
    const double cost = cost_of(tried[lowest]);
    without_gain = cost < best.cost * (1 - kMinGain) ? 0 : without_gain + 1;
    damping = std::clamp(damping * (lowest == 0 ? 0.1 : factors[lowest]), 1e-9, 1e6);
    if (!(cost < best.cost)) {
      damping = std::min(damping * 100, 1e6);
      continue;
    }
    best.cost = cost;
    best.point = points[lowest];
    r = tried[lowest];
  }
  return best;
}

}  // namespace flappy::identify
