// The question what is missing in the model of a vehicle with wings, from its flights alone, without references. What
// every model gets wrong, the model discrepancy, may hide what is missing. Contrast and BeatAveraged answer other
// questions by other rules (question.hpp); base-class comments say what each function is for, those here what is
// particular. Also fits the references of a contrast of beat-averaged vehicles (question_of).
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

class Alone : public Question {
 public:
  explicit Alone(double min_step_nats) : min_step_nats_(min_step_nats) {}

  /// All flights but the first.
  std::vector<std::size_t> offsets(const Flights& flights) const override;
  std::vector<std::size_t> apart(const Flights& /*flights*/) const override { return {}; }
  /// Blocks whose scale has as many degrees of freedom as that of the place, or more: of wings, those of the place
  /// alone, of a beat-averaged vehicle all.
  bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const override;
  Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const override;
  int max_passes() const override { return 1; }

  double min_step_nats() const override { return min_step_nats_; }
  /// Yes for all effects but those that are undone in the log.
  bool law_may_deviate(const Unknown& magnitude) const override;
  /// Only of effects that act by the place, in functions of the place.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  LawPrior law_prior(const ModelDiscrepancy& discrepancy) const override;
  BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Fit& fit) const override;
  Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                               const Eigen::VectorXd& there, const BasisCoefficients& sd) const override;
  /// The model's errors are larger than what a linear model gets wrong over usual differences.
  bool fits_effects_finely() const override { return false; }
  NearSteps near_steps(const ModelDiscrepancy& discrepancy) const override;
  /// All of them.
  std::size_t minors(const sim::Randomisation& uncertain) const override;
  /// RobotFit::background of all effects, with shapes.
  std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const override;
  /// As larger background magnitudes.
  void describe_rest(RobotFit& robot) const override;
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;

  RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
                     const ReferenceFit* reference) const override;
  VerdictRule rule(const RobotFit& robot, VerdictRule given) const override;
  /// Of the vehicle file with its nuisances.
  double log_evidence_of_none(const RobotFit& robot) const override;
  /// By Fitter::fit_effects: the parameters stay.
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  /// By Fitter::fit_given.
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return kMaxFurther; }
  /// By simulation, less what nuisances explain.
  std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                      const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                      int threads) const override;
  /// Credits backgrounds to other hypotheses, then refutes idle effects (refute_idle_effects).
  void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
              Inference& d) const override;
  std::string pool(const ScoredHypothesis& hypothesis) const override;
  void choose_predicting(Inference& d) const override;
  CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                              const Inference& d) const override;
  /// None.
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;
  Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
              const sim::Randomisation& as_filed) const override;
  std::vector<BasisCoefficients> known_columns(const Rival& rival, const std::optional<Fit>& first) const override;

 protected:
  /// Largest number of iterations of a fit of effects with the parameters. Choice.
  static constexpr int kFitIterations = 6;
  /// Parameters and effects that predict the flights by themselves, without nuisances: with the background magnitudes
  /// of effects of models (ModelDiscrepancy::of_models), around which all are fitted once more.
  virtual CorrectedParameters by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                            const Fit& fit) const;
  /// The most probable parameters and effects of a fit, and the minor draws that go with them.
  static CorrectedParameters joint_parameters(const RobotFit& robot, const Fitter& without_background,
                                              const Hypothesis& hypothesis, const Fit& fit);

 private:
  double min_step_nats_;
};

/// Refutes hypotheses with an effect that does not lower the loss of test flights held out: one effect against the
/// parameters alone, a set against each set of one effect fewer.
void refute_idle_effects(const FlightList& tests, Inference& d);
/// The pool of a hypothesis: pool_name() of its effects, or "/" and its kind. Also of Contrast, but for none.
std::string pool_of(const ScoredHypothesis& hypothesis);
/// Parameters that predict these flights, which become the tests of a fit of their own, and background magnitudes that
/// Alone::by_themselves adds; no other effects. ReferenceFit calls it with the references of a contrast.
CorrectedParameters corrected_without_effects(const FlightList& flights, const sim::Randomisation& uncertain,
                                              const InferenceOptions& options);

}  // namespace flappy::gap
