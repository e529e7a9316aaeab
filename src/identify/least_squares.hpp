// Bounded nonlinear least squares (Levenberg-Marquardt) with evaluations in batches: one call for the Jacobian, one for the steps of all
// damping factors.
//
// A force map is smooth where the beat is periodic: second differences over 1e-3 of a parameter's range are below 0.1 standard
// deviations of a good sensor. It jumps where wings hardly flip or the stroke meets its stops. Small kinks remain. In a direction in
// which the residuals hardly change, kinks look like slope, and the direction would seem ten times better known than it is. So the
// Jacobian uses central differences along the singular directions of the previous Jacobian, each so long that the residuals change by
// about their noise.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace flappy::identify {

/// Returns the weighted residuals of several points of the unit cube; not finite where a point cannot be evaluated.
using Residuals = std::function<std::vector<Eigen::VectorXd>(const std::vector<Eigen::VectorXd>& points)>;

inline constexpr double kDifference = 1e-3;  // shortest step each way, as a share of the range
inline constexpr double kFarthest = 0.05;    // longest

/// Steps of kDifference along each parameter, as columns.
Eigen::MatrixXd first_steps(Eigen::Index size);
/// Steps along the singular directions of `slopes`, as columns: so long that the norm of the residuals' change is about
/// `noise`, within kDifference and kFarthest and inside the unit cube.
Eigen::MatrixXd steps_along(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& point, double noise);

/// d residuals / d point from central differences over the columns of `steps`, one-sided at a bound.
Eigen::MatrixXd jacobian(const Residuals& residuals, const Eigen::VectorXd& point, const Eigen::MatrixXd& steps);

struct LeastSquares {
  Eigen::VectorXd point;
  double cost = 0;  ///< sum of squared residuals
  int iterations = 0;
  std::size_t evaluations = 0;
};

/// The local minimum of the cost reached from `start`, inside the unit cube; the cost is infinite where `start` cannot
/// be evaluated. `more`: called before each iteration; returning false ends the search.
LeastSquares minimise(const Residuals& residuals, const Eigen::VectorXd& start,
                      const std::function<bool(const LeastSquares&)>& more = {});

}  // namespace flappy::identify
