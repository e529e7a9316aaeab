#include "identify/fit_problem.hpp"

#include <cmath>

namespace flappy::identify {
namespace {

using Eigen::VectorXd;

constexpr double kJump = 1;  // least second difference of a jump, in standard deviations

double square(double x) { return x * x; }

}  // namespace

std::array<double, 2> group_rms(const std::vector<Wrench>& wrenches) {
  std::array<double, 2> sum{};
  for (const Wrench& w : wrenches)
    for (int k = 0; k < kChannels; ++k) sum[is_force(k) ? 0 : 1] += square(w[static_cast<std::size_t>(k)]);
  for (double& s : sum) s = std::sqrt(s / (3 * static_cast<double>(wrenches.size())));
  return sum;
}

MapError map_error(const std::vector<Wrench>& measured, const std::vector<Wrench>& simulated) {
  const auto scale = group_rms(measured);
  MapError e;
  double off = 0, all = 0;
  for (std::size_t i = 0; i < measured.size(); ++i)
    for (int k = 0; k < kChannels; ++k) {
      const auto c = static_cast<std::size_t>(k);
      const double d = scale[is_force(k) ? 0 : 1] > 0 ? 1 / scale[is_force(k) ? 0 : 1] : 0;
      const double difference = measured[i][c] - simulated[i][c];
      off += square(d * difference);
      all += square(d * measured[i][c]);
      e.rms[c] += square(difference) / static_cast<double>(measured.size());
    }
  for (double& r : e.rms) r = std::sqrt(r);
  e.total = 100 * std::sqrt(off / all);
  return e;
}

std::vector<Wrench> estimated_sd(const MeasuredMap& measured, const std::vector<Wrench>& simulated,
                                 std::size_t parameters) {
  std::vector<Wrench> left = simulated;
  for (std::size_t i = 0; i < left.size(); ++i)
    for (std::size_t k = 0; k < kChannels; ++k) left[i][k] -= measured.wrenches[i][k];
  const auto rms = group_rms(left), scale = group_rms(measured.wrenches);
  const auto n = static_cast<double>(measured.size() * kChannels);
  const double lost = std::sqrt(n / std::max(1.0, n - static_cast<double>(parameters)));
  Wrench sd;
  for (int k = 0; k < kChannels; ++k) {
    const std::size_t g = is_force(k) ? 0 : 1;
    sd[static_cast<std::size_t>(k)] = std::max(rms[g] * lost, 1e-9 * scale[g]);
  }
  return std::vector<Wrench>(measured.size(), sd);
}

std::vector<std::size_t> jumping_inputs(const Problem& problem, const VectorXd& point) {
  std::vector<VectorXd> points = {point};
  for (Eigen::Index i = 0; i < point.size(); ++i) {
    if (point[i] < kDifference || point[i] > 1 - kDifference) continue;
    for (const double way : {-kDifference, kDifference}) {
      points.push_back(point);
      points.back()[i] += way;
    }
  }
  const std::vector<VectorXd> r = problem(points);
  std::vector<std::size_t> jumping;
  for (Eigen::Index input = 0; input < r[0].size() / kChannels; ++input) {
    double worst = 0;
    for (std::size_t i = 1; i < r.size(); i += 2)
      worst = std::max(worst, (r[i] + r[i + 1] - 2 * r[0]).segment<kChannels>(input * kChannels).cwiseAbs().maxCoeff());
    if (!(worst <= kJump)) jumping.push_back(static_cast<std::size_t>(input));
  }
  return jumping;
}

}  // namespace flappy::identify
