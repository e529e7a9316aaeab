// How well a fit knows its parameters.
//
// Intervals are those of the linearised map at the optimum: in units of the bounds, with Jacobian J of the cost's terms,
// covariance C = (J'J + 12 I)^-1. The 12 is the precision of a uniform distribution over the bounds: what is known before
// anything is measured. A misfit far above the noise (a map no parameters reach) widens C by its ratio.
// Where starts end in several places whose costs the noise does not tell apart, intervals hold them all.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "identify/fit_problem.hpp"

namespace flappy::identify {

struct FittedParameter {
  std::string path;
  double nominal = 0, value = 0, low = 0, high = 0;  ///< 95 % interval, within the bounds
  double lower_bound = 0, upper_bound = 0;
  bool seen = true;  ///< its interval is narrower than a share of its bounds
  bool at_bound = false;
  bool at_nominal = false;  ///< unseen, and put back; the others are fitted with it there
};

/// Two parameters that the map tells apart badly.
struct Confounded {
  std::string first, second;
  double correlation = 0;
};

/// A combination of parameters, each in units of its bounds, that is known from the bounds alone.
struct WeakDirection {
  double singular_value = 0;
  std::vector<std::pair<std::string, double>> members;  ///< weights of the vector of length 1, largest first
};

/// Where a start ended.
struct End {
  double cost = 0;
  Eigen::VectorXd point;
};

/// Variance of a residual, of those that a fit leaves: 1 where it leaves the declared noise alone.
double variance_left(double cost, Eigen::Index residuals, Eigen::Index parameters);

/// Cost above the lowest that noise explains in 19 of 20 maps, for `parameters` of them. `noise`: variance of a residual.
double explained_by_noise(std::size_t parameters, double noise);

/// Starts that ended as low as the lowest, of `residuals` in standard deviations where those are `declared`, else in
/// units of the map itself.
int count_agreed(const std::vector<double>& costs, Eigen::Index residuals, Eigen::Index parameters, bool declared);

/// Those `ends` whose cost, over what is fitted in the end, noise allows above the lowest of them and of `point`.
std::vector<End> likely_ends(const Problem& problem, std::vector<End> ends, const Eigen::VectorXd& point);

struct Intervals {
  std::vector<FittedParameter> parameters;
  std::vector<Confounded> confounded;  ///< beyond +-0.9
  std::vector<double>
      singular_values;              ///< of J, largest first: below sqrt(12) a direction is known from its bounds alone
  std::vector<WeakDirection> weak;  ///< those, weakest first
  double misfit = 0;                ///< cost per degree of freedom; about 1 where only noise is left
};
Intervals describe(const Problem& problem, const Eigen::VectorXd& point, const Eigen::VectorXd& nominal,
                   const std::vector<End>& ends);

/// The widest of those `free` whose interval is that of an unseen parameter while all others stay where they are not free;
/// -1 where all are seen.
Eigen::Index widest_unseen(const Problem& problem, const Eigen::VectorXd& point, const std::vector<Eigen::Index>& free,
                           const std::vector<Eigen::Index>& candidates);

}  // namespace flappy::identify
