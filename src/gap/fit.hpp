// Finds the most probable unknowns of a hypothesis: Gauss-Newton on the rows of whole flights, whose derivatives are
// differences between vehicles that fly side by side as lanes.
#pragma once

#include "gap/evidence.hpp"
#include "gap/hypothesis.hpp"

namespace flappy::gap {

/// A hypothesis at given coordinates, linearised: what is left of the measurement, and how it changes.
struct Linearised {
  Eigen::VectorXd at;
  Signature residual;
  std::vector<Signature> columns;  ///< change of the prediction for a unit of each coordinate
};

struct Fit {
  Linearised point;
  Posterior posterior;                    ///< of `coordinates`, relative to `point.at`
  std::vector<Eigen::Index> coordinates;  ///< all but those without which the vehicle comes apart
  int iterations = 0;
};

class Fitter {
 public:
  Fitter(const std::vector<CarriedFlight>& flights, Evidence& evidence, Discrepancy discrepancy, int threads)
      : flights_(flights), evidence_(evidence), discrepancy_(discrepancy), threads_(threads) {}

  /// Residuals under many candidates; empty signatures for vehicles that come apart.
  std::vector<Signature> residuals(const std::vector<Candidate>& candidates) const;
  /// Derivatives for the coordinates `which`, the others' columns are empty.
  Linearised linearise(const Hypothesis& hypothesis, const Eigen::VectorXd& at, const std::vector<Eigen::Index>& which) const;
  /// From `start` on, at most `iterations` linearisations; empty residual where the vehicle comes apart at once.
  Fit fit(const Hypothesis& hypothesis, Eigen::VectorXd start, int iterations) const;

 private:
  double cost(const Signature& residual, const Eigen::VectorXd& at) const;

  const std::vector<CarriedFlight>& flights_;
  Evidence& evidence_;
  Discrepancy discrepancy_;
  int threads_;
};

}  // namespace flappy::gap
