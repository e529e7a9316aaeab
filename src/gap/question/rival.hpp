// A hypothesis as a vehicle that may fly next.
#pragma once

#include <string>
#include <vector>

#include "gap/question/inferred.hpp"

namespace flappy::gap {

struct Rival {
  std::string name;
  double probability;
  Hypothesis hypothesis;
  Eigen::VectorXd at;
  Directions directions;
  Eigen::MatrixXd covariance;  ///< along the directions
  bool open;  ///< its effect was fitted only linearly: the vehicle of the parameters, with magnitudes added
  VehicleHypothesis vehicle() const { return hypothesis.vehicle(at); }
};

/// Effects joined by +, or "none" or "parameters".
std::string name_of(const ScoredHypothesis& hypothesis);
/// A rival in which nothing is uncertain.
Rival certain_rival(const ScoredHypothesis& hypothesis, const Hypothesis& h, const Eigen::VectorXd& at);
/// A rival with parameters or effects as they were fitted, which may be out of their ranges. `d.parameters`: those of a
/// rival that was left open.
Rival fitted_rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain);
/// Columns along a rival's directions for the shared parameters, from another rival's columns: spares simulations.
std::vector<BasisCoefficients> turned(const Fit& l, const Directions& directions, Eigen::Index shared);

}  // namespace flappy::gap
