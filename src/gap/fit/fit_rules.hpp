// The part of a question (docs/glossary.md) that Fitter and RobotFit call: priors of laws, steps of fits, backgrounds.
// Alone asks what the model lacks, Contrast asks what changed since the references. Both are in gap/question/ and
// implement this class.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gap/evidence/evidence.hpp"
#include "gap/evidence/evidence_rules.hpp"
#include "gap/fit/hypothesis.hpp"

namespace flappy::gap {

struct Background;
struct Fit;
class Fitter;
class RobotFit;

/// Which vehicles magnitude_steps() simulates in addition, for the slope at a small magnitude, such as a background's.
/// Effects of sensors are linear and need none, except delays.
struct NearSteps {
  std::function<double(const std::string& effect)>
      sd;               ///< prior standard deviation of the background; empty: no such vehicle
  bool shapes = false;  ///< also the usual step, with one shape parameter moved
  bool delays = false;  ///< also of delays of sensors
};

/// Prior of the law factor (Fit::law_factor): log-normal with median 1. `spread`: standard deviation of the logarithm;
/// the factor lies between 1 / `most` and `most`.
struct LawPrior {
  double spread, most;
};

class FitRules : public EvidenceRules {
 public:
  /// Smallest gain of evidence, in nats, for which a fit that moves the parameters takes another step.
  virtual double min_step_nats() const = 0;
  /// Whether the part of an effect that this magnitude scales may follow another law than the catalogue's.
  virtual bool law_may_deviate(const Unknown& magnitude) const = 0;
  /// [group][basis] Standard deviation of the deviations of an effect's law; 0: it follows the catalogue's. `change`:
  /// [group][basis] what the effect adds to the prediction.
  virtual BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                                   double law_factor) const = 0;
  /// Prior by which RobotFit::weigh weighs a law factor that is not 1. It tries powers of two within the bounds.
  virtual LawPrior law_prior(const ModelDiscrepancy& discrepancy) const = 0;
  /// Whether RobotFit::weigh also searches the scales of test flights and backgrounds from their priors.
  virtual bool weighs_from_priors() const = 0;
  /// [group][basis] Standard deviation of the discrepancy in a fit that moves the effects alone (Fitter::fit_effects).
  virtual BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                                   const Fit& fit) const = 0;
  /// Whether Fitter::fit_effects narrows its finite differences to the width of the posterior, and goes on until a step
  /// is short compared with that width.
  virtual bool fits_effects_finely() const = 0;
  /// [coordinate] Where Fitter::fit_effects goes next. `fit`: where it is; `there`: where the linear model of `fit`
  /// leads; `sd`: that of effects_discrepancy_sd.
  virtual Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                                       const Eigen::VectorXd& there, const BasisCoefficients& sd) const = 0;
  /// Vehicles in addition, because a small magnitude may have another slope than a large one.
  virtual NearSteps near_steps(const ModelDiscrepancy& discrepancy) const = 0;
  /// How many minor draws of the vehicle, from the first on, are nuisance regressors.
  virtual std::size_t minors(const sim::Randomisation& uncertain) const = 0;
  /// Background magnitudes that are fitted jointly with every hypothesis.
  virtual std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const = 0;
  /// Takes the residual of the first fit of the parameters, which has no nuisances, as noise or as larger background
  /// magnitudes of `robot`. RobotFit calls it before it fits the parameters again, with nuisances.
  virtual void describe_rest(RobotFit& robot) const = 0;
  /// Scales with a larger background of one effect, where that is more probable (RobotFit::larger_background). None:
  /// none is, or scales are not fitted.
  virtual std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                                  const Scales& now) const = 0;
};

}  // namespace flappy::gap
