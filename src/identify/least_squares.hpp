// Bounded nonlinear least squares (Levenberg and Marquardt) whose evaluations come in batches: the Jacobian is one call,
// the steps of all damping factors another.
//
// A force map is smooth where each beat is like the last: second differences over 1e-3 of a parameter's range are then below
// 0.1 standard deviations of a good sensor. It jumps where wings hardly flip or the stroke meets its stops. The Jacobian is
// of central differences over 2e-3 of the range: as far as the last steps of a fit move, and mean slopes over small kinks
// instead of the slope of one piece.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace flappy::identify {

/// Weighted residuals of each of several points of the unit cube; not finite where a point cannot be evaluated.
using Residuals = std::function<std::vector<Eigen::VectorXd>(const std::vector<Eigen::VectorXd>& points)>;

inline constexpr double kDifference = 1e-3;  // each way, of the range

/// d residuals / d point: central differences, one-sided at a bound.
Eigen::MatrixXd jacobian(const Residuals& residuals, const Eigen::VectorXd& point, double difference = kDifference);

struct LeastSquares {
  Eigen::VectorXd point;
  double cost = 0;  ///< sum of squared residuals
  int iterations = 0;
  std::size_t evaluations = 0;
};

/// The lowest cost downhill of `start`, inside the unit cube. `more`: asked before each iteration, false ends the search.
LeastSquares minimise(const Residuals& residuals, const Eigen::VectorXd& start,
                      const std::function<bool(const LeastSquares&)>& more = {});

}  // namespace flappy::identify
