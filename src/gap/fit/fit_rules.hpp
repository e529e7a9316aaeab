// What a question changes in fits of vehicles. The questions are in gap/question/; Fitter and RobotFit call this.
#pragma once

#include <Eigen/Dense>
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

/// Prior of the law factor (Fit::law_factor): standard deviation of its log, and its largest value.
struct LawPrior {
  double spread, most;
};

class FitRules : public EvidenceRules {
 public:
  /// Smallest gain of evidence, in nats, for which a fit takes another step.
  virtual double min_step_nats() const = 0;
  /// Whether the law of an effect may deviate from the catalogue's in what this magnitude changes.
  virtual bool law_may_deviate(const Unknown& magnitude) const = 0;
  /// Standard deviation, [group][basis], of the deviations of an effect's law. `change`: what the effect adds.
  virtual BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                                   double law_factor) const = 0;
  /// Prior by which a law factor above 1 is weighed.
  virtual LawPrior law_prior(const ModelDiscrepancy& discrepancy) const = 0;
  /// Standard deviation, [group][basis], of the discrepancy in a fit of the effects alone.
  virtual BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                                   const Fit& fit) const = 0;
  /// Coordinates to which a fit of the effects alone goes next. `there`: where its linear model goes; `sd`:
  /// effects_discrepancy_sd.
  virtual Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                                       const Eigen::VectorXd& there, const BasisCoefficients& sd) const = 0;
  /// Priors of background magnitudes, about which magnitudes and shapes are also simulated; null: about none.
  virtual const ModelDiscrepancy* near_steps(const ModelDiscrepancy& discrepancy) const = 0;
  /// Number of minor draws of the vehicle that are nuisances.
  virtual std::size_t minors(const sim::Randomisation& uncertain) const = 0;
  /// Backgrounds that are fitted jointly with every hypothesis.
  virtual std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const = 0;
  /// Before the parameters are fitted with their nuisances: what is left of them counts as noise, or as background.
  virtual void describe_rest(RobotFit& robot) const = 0;
  /// Scales with a larger background of one effect that gain evidence; none: none gains, or scales are not fitted.
  virtual std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                                  const Scales& now) const = 0;
};

}  // namespace flappy::gap
