// Bounded nonlinear least squares (Levenberg and Marquardt) whose evaluations come in batches: the Jacobian is one call,
// the steps of all damping factors another.
//
// A force map is smooth where each beat is like the last: second differences over 1e-3 of a parameter's range are then below
// 0.1 standard deviations of a good sensor. It jumps where wings hardly flip or the stroke meets its stops. Small kinks
// remain, and along a direction that residuals hardly feel they look like slope: such a direction would seem known ten
// times better than it is. So the Jacobian is of central differences along the singular directions of the last one, each
// as far as the residuals' own noise reaches.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace flappy::identify {

/// Weighted residuals of each of several points of the unit cube; not finite where a point cannot be evaluated.
using Residuals = std::function<std::vector<Eigen::VectorXd>(const std::vector<Eigen::VectorXd>& points)>;

inline constexpr double kDifference = 1e-3;  // least step each way, of the range
inline constexpr double kFarthest = 0.05;    // most

/// kDifference of each parameter.
Eigen::MatrixXd first_steps(Eigen::Index size);
/// Along the singular directions of `slopes`, as far as all residuals together change by `noise`, inside the unit cube.
Eigen::MatrixXd steps_along(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& point, double noise);

/// d residuals / d point: central differences over the columns of `steps`, one-sided at a bound.
Eigen::MatrixXd jacobian(const Residuals& residuals, const Eigen::VectorXd& point, const Eigen::MatrixXd& steps);

struct LeastSquares {
  Eigen::VectorXd point;
  double cost = 0;  ///< sum of squared residuals
  int iterations = 0;
  std::size_t evaluations = 0;
};

/// The lowest cost downhill of `start`, inside the unit cube; infinite where `start` cannot be evaluated. `more`: asked
/// before each iteration, false ends the search.
LeastSquares minimise(const Residuals& residuals, const Eigen::VectorXd& start,
                      const std::function<bool(const LeastSquares&)>& more = {});

}  // namespace flappy::identify
