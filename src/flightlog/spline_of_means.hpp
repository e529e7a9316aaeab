// A continuous signal from its means over adjoining intervals, as an integrating sensor delivers them.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace flappy::flightlog {

/// Derivative of the natural cubic spline through the integral of the means: continuous, quadratic in each interval.
class SplineOfMeans {
 public:
  SplineOfMeans() = default;
  /// `bounds_s` has one element more than `means`.
  SplineOfMeans(const std::vector<double>& bounds_s, std::vector<Eigen::Vector3d> means);
  /// The signal in interval `k`; `u` is the position in it, from 0 to 1.
  Eigen::Vector3d value(std::size_t k, double u) const;
  /// Integral over [u, v] of interval `k`, divided by the length of the interval.
  Eigen::Vector3d integral(std::size_t k, double u, double v) const;
  /// Integral over s in [u, v] of the integral over [u, s], divided by the square of the interval's length.
  Eigen::Vector3d second_integral(std::size_t k, double u, double v) const;

 private:
  std::vector<Eigen::Vector3d> means_, knots_;
};

}  // namespace flappy::flightlog
