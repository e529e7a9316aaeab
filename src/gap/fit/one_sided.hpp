// Magnitudes that cannot be negative have half-normal priors. Fits treat these priors as normal; this is the
// correction.
#pragma once

#include "gap/fit/hypothesis.hpp"

namespace flappy::gap {

/// log(2 P(x > 0)), x ~ N(mean, sd^2).
double log_twice_positive(double mean, double sd);

/// What a normal posterior of a hypothesis becomes once its one-sided magnitudes have to be positive.
struct OneSided {
  double log_factor = 0;  ///< logarithm of the evidence with half-normal priors over that with normal priors
  Eigen::VectorXd mean;   ///< [coordinate] posterior mean
};

/// Conditions the posterior on each one-sided magnitude being positive, one after another, and keeps it normal. The
/// magnitude that is positive with the smallest probability comes first (Mendell and Elston, Biometrics 30, 1974,
/// 41-57). `mean`, `covariance`: of the hypothesis' coordinates, with normal priors.
OneSided one_sided(const Hypothesis& hypothesis, Eigen::VectorXd mean, Eigen::MatrixXd covariance);

}  // namespace flappy::gap
