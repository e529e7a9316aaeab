#include "flightlog/spline_of_means.hpp"

#include <utility>

namespace flappy::flightlog {

using Eigen::Vector3d;

SplineOfMeans::SplineOfMeans(const std::vector<double>& bounds_s, std::vector<Vector3d> means)
    : means_(std::move(means)), knots_(means_.size() + 1) {
  // The values at the bounds make the derivative continuous: the tridiagonal system of the natural cubic spline.
  const std::size_t n = means_.size();
  std::vector<double> upper(n + 1);
  upper[0] = 0.5;
  knots_[0] = 1.5 * means_[0];
  for (std::size_t k = 1; k <= n; ++k) {
    const bool last = k == n;
    const double before = bounds_s[k] - bounds_s[k - 1], after = last ? 0 : bounds_s[k + 1] - bounds_s[k];
    const double lower = last ? 1 : after, middle = last ? 2 : 2 * (before + after);
    const Vector3d right =
        last ? Vector3d(3 * means_[k - 1]) : Vector3d(3 * (after * means_[k - 1] + before * means_[k]));
    const double pivot = middle - lower * upper[k - 1];
    upper[k] = last ? 0 : before / pivot;
    knots_[k] = (right - lower * knots_[k - 1]) / pivot;
  }
  for (std::size_t k = n; k-- > 0;) knots_[k] -= upper[k] * knots_[k + 1];
}

Vector3d SplineOfMeans::value(std::size_t k, double u) const {
  return knots_[k] * ((1 - u) * (1 - 3 * u)) + means_[k] * (6 * u * (1 - u)) + knots_[k + 1] * (u * (3 * u - 2));
}

Vector3d SplineOfMeans::integral(std::size_t k, double u, double v) const {
  const auto from_0 = [&](double s) -> Vector3d {
    return knots_[k] * (s * (1 - s) * (1 - s)) + means_[k] * (s * s * (3 - 2 * s)) + knots_[k + 1] * (s * s * (s - 1));
  };
  return from_0(v) - from_0(u);
}

Vector3d SplineOfMeans::second_integral(std::size_t k, double u, double v) const {
  const auto from_0 = [&](double s) -> Vector3d {
    return knots_[k] * (s * s * (0.5 + s * (s / 4 - 2.0 / 3))) + means_[k] * (s * s * s * (1 - s / 2)) +
           knots_[k + 1] * (s * s * s * (s / 4 - 1.0 / 3));
  };
  return from_0(v) - from_0(u) - (v - u) * integral(k, 0, u);
}

}  // namespace flappy::flightlog
