// What changed between reference flights and test flights of one robot. What a model gets wrong in both cancels; what
// sessions differ by does not.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// The references' parameters and background, and the test flights' effects. The magnitudes of an effect that both have
/// add up.
CorrectedParameters with_effects(const sim::Randomisation& uncertain, const CorrectedParameters& reference,
                                 const Hypothesis& tests, const Eigen::VectorXd& at);

/// Largest number of passes in which blocks and their centres are maximised in turn. Choice.
inline constexpr int kMaxPasses = 100;

class Contrast : public Question {
 public:
  explicit Contrast(double min_step_nats) : min_step_nats_(min_step_nats) {}

  std::vector<std::size_t> offsets(const Flights& flights) const override;
  std::vector<std::size_t> apart(const Flights& flights) const override;
  bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const override;
  Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const override;
  /// Blocks of many degrees of freedom hold each other back: they and their centres are maximised until these settle.
  int max_passes() const override { return kMaxPasses; }

  double min_step_nats() const override { return min_step_nats_; }
  bool law_may_deviate(const Unknown& /*magnitude*/) const override { return true; }
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  LawPrior law_prior(const ModelDiscrepancy& discrepancy) const override;
  BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Fit& fit) const override;
  Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                               const Eigen::VectorXd& there, const BasisCoefficients& sd) const override;
  const ModelDiscrepancy* near_steps(const ModelDiscrepancy& /*discrepancy*/) const override { return nullptr; }
  std::size_t minors(const sim::Randomisation& /*uncertain*/) const override { return 0; }
  std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const override;
  void describe_rest(RobotFit& /*robot*/) const override {}
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;

  RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
                     const ReferenceFit* reference) const override;
  VerdictRule rule(const RobotFit& robot, VerdictRule given) const override;
  double log_evidence_of_none(const RobotFit& robot) const override;
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return kMaxFurther; }
  std::vector<Residuals> held_out(const Fitter& fitter, const Flights& flights,
                                  const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                  int threads) const override;
  void refute(const RobotFit& /*robot*/, const Fitter& /*fitter*/, const Flights& /*flights*/,
              const VerdictRule& /*rule*/, Inference& /*d*/) const override {}
  std::string pool(const ScoredHypothesis& hypothesis) const override;
  void choose_predicting(Inference& d) const override;
  CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                              const Inference& d) const override;
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;
  std::vector<SeenQuantity> seen(const RobotFit& robot) const override;
  Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
              const sim::Randomisation& as_filed) const override;
  std::vector<BasisCoefficients> known_columns(const Rival& rival, const std::optional<Fit>& first) const override;

 private:
  double min_step_nats_;
};

}  // namespace flappy::gap
