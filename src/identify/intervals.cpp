#include "identify/intervals.hpp"

#include <algorithm>
#include <cmath>

#include "io/statistics.hpp"

namespace flappy::identify {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kUniformPrecision = 12;  // 1 / variance of a uniform distribution over [0, 1]
constexpr double kConfounded = 0.9;

struct Linear {
  MatrixXd slopes;  ///< Jacobian of the residuals, in standard deviations of the noise, which a misfit increases
  double misfit = 0;
};

Linear linearised(const Problem& problem, const VectorXd& point) {
  const VectorXd left = problem({point}).front();
  Linear l;
  l.misfit = variance_left(left.squaredNorm(), left.size(), point.size());
  const double freedom = std::max(1.0, static_cast<double>(left.size() - point.size()));
  const double noise = std::sqrt(l.misfit > 1 + 3 * std::sqrt(2 / freedom) ? l.misfit : 1);
  l.slopes = jacobian(problem, point, first_steps(point.size()));
  for (int i = 0; i < 2; ++i) l.slopes = jacobian(problem, point, steps_along(l.slopes, point, noise));
  l.slopes /= noise;
  return l;
}

MatrixXd covariance(const MatrixXd& slopes) {
  return (slopes.transpose() * slopes + kUniformPrecision * MatrixXd::Identity(slopes.cols(), slopes.cols())).inverse();
}

std::vector<WeakDirection> weak_directions(const Eigen::JacobiSVD<MatrixXd>& svd, const FitConfig& config) {
  constexpr double kMember = 0.3;  // least component of a member: its square is about a twelfth of the sum
  std::vector<WeakDirection> weak;
  for (Eigen::Index k = svd.singularValues().size() - 1; k >= 0; --k) {
    if (svd.singularValues()[k] * svd.singularValues()[k] >= kUniformPrecision) break;
    WeakDirection d{svd.singularValues()[k], {}};
    for (Eigen::Index i = 0; i < svd.matrixV().rows(); ++i)
      if (const double weight = svd.matrixV()(i, k); std::abs(weight) >= kMember)
        d.members.emplace_back(config.parameters[static_cast<std::size_t>(i)].path, weight);
    std::ranges::sort(d.members, [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
    weak.push_back(std::move(d));
  }
  return weak;
}

}  // namespace

double variance_left(double cost, Eigen::Index residuals, Eigen::Index parameters) {
  return cost / std::max(1.0, static_cast<double>(residuals - parameters));
}

double explained_by_noise(std::size_t parameters, double noise) {
  return noise * io::chi2_quantile(0.95, static_cast<double>(parameters));
}

int count_agreed(const std::vector<double>& costs, Eigen::Index residuals, Eigen::Index parameters, bool declared) {
  const double lowest = *std::ranges::min_element(costs);
  const double noise = declared ? 1 : variance_left(lowest, residuals, parameters);
  constexpr double kNothing = 1e-12;  // relative to the square of the map: errors in the sixth digit do not count
  const double most = 1.01 * lowest + noise + kNothing * static_cast<double>(residuals);
  return static_cast<int>(std::ranges::count_if(costs, [&](double c) { return c <= most; }));
}

std::vector<End> likely_ends(const Problem& problem, std::vector<End> ends, const VectorXd& point) {
  std::vector<VectorXd> points = {point};
  for (const End& end : ends) points.push_back(end.point);
  const std::vector<VectorXd> r = problem(points);
  double lowest = r[0].squaredNorm();
  for (std::size_t i = 0; i < ends.size(); ++i) {
    ends[i].cost = r[i + 1].squaredNorm();
    lowest = std::min(lowest, ends[i].cost);
  }
  const double noise = std::max(1.0, variance_left(lowest, r[0].size(), point.size()));
  std::erase_if(ends, [&](const End& e) { return !(e.cost <= lowest + explained_by_noise(problem.size(), noise)); });
  return ends;
}

Intervals describe(const Problem& problem, const VectorXd& point, const VectorXd& nominal,
                   const std::vector<End>& ends) {
  const FitConfig& config = problem.config();
  const Linear l = linearised(problem, point);
  const Eigen::JacobiSVD<MatrixXd> svd(l.slopes, Eigen::ComputeThinV);
  const MatrixXd c = covariance(l.slopes);
  VectorXd low = point - io::kNormal975 * c.diagonal().cwiseSqrt(),
           high = point + io::kNormal975 * c.diagonal().cwiseSqrt();
  for (const End& end : ends) low = low.cwiseMin(end.point), high = high.cwiseMax(end.point);
  Intervals result;
  result.misfit = l.misfit;
  result.singular_values.assign(svd.singularValues().begin(), svd.singularValues().end());
  result.weak = weak_directions(svd, config);
  for (Eigen::Index i = 0; i < point.size(); ++i) {
    const FitParameter& p = config.parameters[static_cast<std::size_t>(i)];
    const auto value = [&](double x) { return p.low + x * (p.high - p.low); };
    result.parameters.push_back({p.path, value(nominal[i]), value(point[i]), std::max(p.low, value(low[i])),
                                 std::min(p.high, value(high[i])), p.low, p.high,
                                 high[i] - low[i] <= config.unseen_share, point[i] <= 0 || point[i] >= 1});
    for (Eigen::Index k = 0; k < i; ++k)
      if (const double r = c(i, k) / std::sqrt(c(i, i) * c(k, k)); std::abs(r) > kConfounded)
        result.confounded.push_back({config.parameters[static_cast<std::size_t>(k)].path, p.path, r});
  }
  return result;
}

Eigen::Index widest_unseen(const Problem& problem, const VectorXd& point, const std::vector<Eigen::Index>& free,
                           const std::vector<Eigen::Index>& candidates) {
  const MatrixXd c = covariance(linearised(problem, point).slopes(Eigen::all, free));
  Eigen::Index widest = -1;
  double most = problem.config().unseen_share;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double width = 2 * io::kNormal975 * std::sqrt(c(at, at));
    if (width <= most || std::ranges::count(candidates, free[i]) == 0) continue;
    most = width;
    widest = free[i];
  }
  return widest;
}

}  // namespace flappy::identify
