// A hypothesis as a vehicle that may fly next (gap/next/next_experiment.hpp). Question::rival makes it.
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
  bool open;  ///< its effect was fitted only linearly: the vehicle of the parameters, with magnitudes added
  VehicleHypothesis vehicle() const { return hypothesis.vehicle(at); }
};

/// Effects joined by +, or "none" or "parameters".
std::string name_of(const ScoredHypothesis& hypothesis);
/// A rival in which nothing is uncertain. `at`: coordinates of `h`.
Rival certain_rival(const ScoredHypothesis& hypothesis, const Hypothesis& h, const Eigen::VectorXd& at);
/// A rival with parameters or effects as they were fitted, which may be out of their ranges. A rival that was left open
/// has the parameters of `d`, and the root mean square of each magnitude under its posterior.
Rival fitted_rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain);
/// [direction] Columns along the first `shared` of `directions`, combined from those of `l`, which needs no simulation:
/// both sets of directions span the same coordinates.
std::vector<BasisCoefficients> turned(const Fit& l, const Directions& directions, Eigen::Index shared);

}  // namespace flappy::gap
