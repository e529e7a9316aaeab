// The rules for the question: what is missing in the model of a vehicle with wings, judged by its flights alone,
// without references? The model discrepancy, what every model gets wrong, may hide what is missing. Contrast and
// BeatAveraged answer other questions by other rules (question.hpp). Comments of the base classes say what each
// function is for; comments here say only what is particular to this class. The class also fits the references of a
// contrast of beat-averaged vehicles (question_of).
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

class Alone : public Question {
 public:
  explicit Alone(double min_step_nats) : min_step_nats_(min_step_nats) {}

  /// All flights except the first.
  std::vector<std::size_t> offsets(const Flights& flights) const override;
  std::vector<std::size_t> apart(const Flights& /*flights*/) const override { return {}; }
  /// Yes for blocks whose scale has at least as many degrees of freedom as the scales of blocks of the place. For
  /// vehicles with wings these are the blocks of the place alone, for beat-averaged vehicles all blocks.
  bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const override;
  Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const override;
  int max_passes() const override { return 1; }

  double min_step_nats() const override { return min_step_nats_; }
  /// Yes for all effects, except those that are undone in the log.
  bool law_may_deviate(const Unknown& magnitude) const override;
  /// 0, except in functions of the place, for effects that act by the place.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  LawPrior law_prior(const ModelDiscrepancy& discrepancy) const override;
  bool weighs_from_priors() const override { return false; }
  BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Fit& fit) const override;
  Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                               const Eigen::VectorXd& there, const BasisCoefficients& sd) const override;
  /// No: the errors of the model are larger than those of linearising over the usual finite differences.
  bool fits_effects_finely() const override { return false; }
  NearSteps near_steps(const ModelDiscrepancy& discrepancy) const override;
  /// All of them.
  std::size_t minors(const sim::Randomisation& uncertain) const override;
  /// RobotFit::background of all effects, with shapes.
  std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const override;
  /// Takes the residual as larger background magnitudes.
  void describe_rest(RobotFit& robot) const override;
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;

  RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
                     const ReferenceFit* reference) const override;
  VerdictRule rule(const RobotFit& robot, VerdictRule given) const override;
  /// That of the vehicle file with its nuisance regressors.
  double log_evidence_of_none(const RobotFit& robot) const override;
  /// Calls Fitter::fit_effects: the parameters stay.
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  /// Calls Fitter::fit_given.
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return kMaxFurther; }
  /// By simulation; subtracts what nuisance regressors explain (held_out_by_simulation).
  std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                      const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                      int threads) const override;
  /// Credits hypotheses without an effect with what its background would explain, then calls refute_idle_effects().
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
  std::vector<SharedColumn> known_columns(const Rival& rival, const std::optional<Fit>& first) const override;

 protected:
  /// Largest number of iterations of a fit of effects with the parameters. Choice.
  static constexpr int kFitIterations = 6;
  /// Parameters and effects that predict the flights by themselves, without nuisance regressors. Background magnitudes
  /// of the effects in ModelDiscrepancy::of_models become effects; then all are fitted once more around the result.
  virtual CorrectedParameters by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                            const Fit& fit) const;
  /// The most probable parameters and effects of a fit, and the minor draws that go with them.
  static CorrectedParameters joint_parameters(const RobotFit& robot, const Fitter& without_background,
                                              const Hypothesis& hypothesis, const Fit& fit);

 private:
  double min_step_nats_;
};

/// Refutes hypotheses with an effect that lowers the loss neither of flights held out nor, if it acts there, of runs on a
/// bench held out. Flights and runs count apart: what shows on a bench may be lost in a flight among larger errors of the
/// air. One effect is compared with the parameters alone, a set of effects with each of its subsets that has one effect
/// fewer.
void refute_idle_effects(const FlightList& tests, const std::function<bool(const std::string&)>& acts_on_bench,
                         Inference& d);
/// The pool of a hypothesis: pool_name() of its effects, or "/" and its kind. Contrast uses it, too, except for the
/// hypothesis none.
std::string pool_of(const ScoredHypothesis& hypothesis);
/// Fits parameters to these flights as to test flights without references. Returns the parameters that predict the
/// flights, with the background magnitudes that Alone::by_themselves adds, but no other effects. ReferenceFit calls it
/// with the references of a contrast.
CorrectedParameters corrected_without_effects(const FlightList& flights, const sim::Randomisation& uncertain,
                                              const InferenceOptions& options);

}  // namespace flappy::gap
