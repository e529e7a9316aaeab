// One explanation of the flights as a vehicle with its uncertainty, to predict what another flight would show if it were
// true (gap/next/next_experiment.hpp). Question::rival makes it.
#pragma once

#include <string>
#include <vector>

#include "gap/question/inferred.hpp"

namespace flappy::gap {

struct Rival {
  std::string name;  ///< name_of() the hypothesis
  double probability;
  Hypothesis hypothesis;
  Eigen::VectorXd at;          ///< [coordinate]
  Directions directions;       ///< along which it is uncertain; none: nothing is
  Eigen::MatrixXd covariance;  ///< [direction][direction]
  bool
      open;  ///< its effect was fitted only linearly; the vehicle has the fitted parameters, and magnitudes in addition
  VehicleHypothesis vehicle() const { return hypothesis.vehicle(at); }
};

/// Effects joined by +, or "none" or "parameters".
std::string name_of(const ScoredHypothesis& hypothesis);
/// A rival in which nothing is uncertain. `at`: coordinates of `h`.
Rival certain_rival(const ScoredHypothesis& hypothesis, const Hypothesis& h, const Eigen::VectorXd& at);
/// A rival with parameters or effects as they were fitted, which may be out of their ranges. A rival that was left open
/// has the parameters of `d`, and the root mean square of each magnitude under its posterior.
Rival fitted_rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain);
/// [direction] Derivatives of the prediction along the first `shared` of `directions`: linear combinations of those of
/// `l`, without a simulation, as both sets of directions span the same coordinates.
std::vector<SharedColumn> turned(const Fit& l, const Directions& directions, Eigen::Index shared);

}  // namespace flappy::gap
