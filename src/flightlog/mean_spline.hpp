// A signal known by its means over adjoining intervals, as an integrating sensor delivers it.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace flappy::flightlog {

/// The signal is the slope of a natural cubic spline through the sums of the means: a quadratic in each interval that has
/// its mean, and no jumps.
class MeanSpline {
 public:
  MeanSpline() = default;
  /// One bound more than means.
  MeanSpline(const std::vector<double>& bounds_s, std::vector<Eigen::Vector3d> means);
  /// At share `u` of interval `k`.
  Eigen::Vector3d value(std::size_t k, double u) const;
  /// Integral over [u, v] of interval `k`, divided by its length.
  Eigen::Vector3d integral(std::size_t k, double u, double v) const;
  /// Of the integral from u on, over [u, v], divided by the square of the length.
  Eigen::Vector3d second_integral(std::size_t k, double u, double v) const;

 private:
  std::vector<Eigen::Vector3d> means_, knots_;
};

}  // namespace flappy::flightlog
