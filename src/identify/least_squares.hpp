// Bounded nonlinear least squares (Levenberg-Marquardt), one batch for the Jacobian, one for all damping factors.
//
// A force map is smooth where the beat is periodic (second differences over 1e-3 of a range below 0.1 sd of a good
// sensor) and jumps where wings hardly flip or strokes meet stops. Small kinks remain. Where residuals hardly change,
// kinks look like slope, and the direction would seem ten times better known. So central differences go along the
// singular directions of the previous Jacobian, each so far that the residuals change by about their noise.
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
/// Columns along the singular directions of `slopes`, so long that the residuals' change has a norm of about `noise`,
/// within kDifference and kFarthest and inside the unit cube.
Eigen::MatrixXd steps_along(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& point, double noise);

/// d residuals / d point from central differences over the columns of `steps`, one-sided at a bound.
Eigen::MatrixXd jacobian(const Residuals& residuals, const Eigen::VectorXd& point, const Eigen::MatrixXd& steps);

struct LeastSquares {
  Eigen::VectorXd point;
  double cost = 0;  ///< sum of squared residuals
  int iterations = 0;
  std::size_t evaluations = 0;
};

/// The local minimum reached from `start`; its cost is infinite where `start` cannot be evaluated. `more`: called
/// before each iteration; returning false ends the search.
LeastSquares minimise(const Residuals& residuals, const Eigen::VectorXd& start,
                      const std::function<bool(const LeastSquares&)>& more = {});

}  // namespace flappy::identify
