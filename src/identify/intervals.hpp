// Uncertainty of fitted parameters, from the map linearised at the optimum: in units of the bounds, with the Jacobian J
// of the residuals, the covariance is C = (J'J + 12 I)^-1; 12 is the precision of the prior, uniform over the bounds. A
// misfit far above the noise (no parameters reproduce the map) multiplies the noise variance. Where starts end at
// points whose costs differ by no more than noise explains, the intervals contain all of them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "identify/fit_problem.hpp"

namespace flappy::identify {

struct FittedParameter {
  std::string path;
  double nominal = 0, value = 0, low = 0, high = 0;  ///< low, high: 95 % interval, within the bounds
  double lower_bound = 0, upper_bound = 0;
  bool seen = true;  ///< whether its interval is narrower than a share of its bounds
  bool at_bound = false;
  bool at_nominal = false;  ///< unseen and put back to nominal before the last fit of the others
};

/// Two parameters that the map hardly tells apart.
struct Confounded {
  std::string first, second;
  double correlation = 0;
};

/// A combination of parameters, in units of their bounds, that only the bounds constrain.
struct WeakDirection {
  double singular_value = 0;
  std::vector<std::pair<std::string, double>> members;  ///< largest components of the unit vector, largest first
};

/// The point at which a start ended.
struct End {
  double cost = 0;
  Eigen::VectorXd point;
};

/// Cost per degree of freedom: the variance of a residual after the fit, 1 where only the declared noise is left.
double variance_left(double cost, Eigen::Index residuals, Eigen::Index parameters);

/// Cost above the lowest that noise of variance `noise` explains in 19 of 20 maps (95 % quantile of chi squared with
/// `parameters` degrees of freedom).
double explained_by_noise(std::size_t parameters, double noise);

/// Number of starts that ended as low as the lowest. `declared`: residuals are in declared sd; else they are relative
/// to the map, and the lowest cost gives their variance.
int count_agreed(const std::vector<double>& costs, Eigen::Index residuals, Eigen::Index parameters, bool declared);

/// The `ends`, costs updated, whose cost exceeds the lowest, `point` included, by no more than noise explains.
std::vector<End> likely_ends(const Problem& problem, std::vector<End> ends, const Eigen::VectorXd& point);

struct Intervals {
  std::vector<FittedParameter> parameters;
  std::vector<Confounded> confounded;  ///< pairs with a correlation beyond +-0.9
  std::vector<double>
      singular_values;  ///< singular values of J, largest first; below sqrt(12) only the bounds constrain a direction
  std::vector<WeakDirection> weak;  ///< these directions, weakest first
  double misfit = 0;                ///< cost per degree of freedom; about 1 where only noise is left
};
Intervals describe(const Problem& problem, const Eigen::VectorXd& point, const Eigen::VectorXd& nominal,
                   const std::vector<End>& ends);

/// The unseen parameter of `candidates` with the widest interval if only the `free` ones are uncertain; -1: none.
Eigen::Index widest_unseen(const Problem& problem, const Eigen::VectorXd& point, const std::vector<Eigen::Index>& free,
                           const std::vector<Eigen::Index>& candidates);

}  // namespace flappy::identify
