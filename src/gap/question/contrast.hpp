// The rules for the question: what changed between reference flights and test flights of one robot with wings? What a
// model gets wrong cancels where the references cover the regimes of the tests (RegimeBasis::covers); what sessions
// differ by does not cancel. SessionContrast derives from this class for beat-averaged vehicles, and answers in its own
// way.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// The corrected vehicle of a contrast. It has the parameters, minor draws and background effects of `reference`, and
/// the effects of `tests` at the coordinates `at` of `tests`; parameters in `at` are ignored. If both have an effect,
/// its magnitudes add up, and its shape parameters are those of `at`. All within their accepted ranges.
CorrectedParameters with_effects(const sim::Randomisation& uncertain, const CorrectedParameters& reference,
                                 const Hypothesis& tests, const Eigen::VectorXd& at);

/// Largest number of passes in which scales of blocks and their centres are maximised alternately. Choice.
inline constexpr int kMaxPasses = 100;

class Contrast : public Question {
 public:
  explicit Contrast(double min_step_nats) : min_step_nats_(min_step_nats) {}

  /// All flights except the first reference and the first test.
  std::vector<std::size_t> offsets(const Flights& flights) const override;
  /// The tests.
  std::vector<std::size_t> apart(const Flights& flights) const override;
  /// Yes for blocks of the test flights, if the references cover the block's class of regimes.
  bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const override;
  /// `given`, with all scales of the test flights multiplied by the power of two that has the largest evidence.
  Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const override;
  /// Enough for the centres to settle, which blocks with narrow priors slow down.
  int max_passes() const override { return kMaxPasses; }

  double min_step_nats() const override { return min_step_nats_; }
  bool law_may_deviate(const Unknown& /*magnitude*/) const override { return true; }
  /// Every law may deviate, by a share of the effect's change (SessionVariation::law_error) in the test flights.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  /// That of ModelDiscrepancy::session.
  LawPrior law_prior(const ModelDiscrepancy& discrepancy) const override;
  bool weighs_from_priors() const override { return true; }
  /// Includes the deviations of the effects' laws.
  BasisCoefficients effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Fit& fit) const override;
  /// The point with the largest evidence among `fit`, points on the way to `there`, and points with smaller magnitudes;
  /// `there` itself for effects that are undone in the log, as these are linear.
  Eigen::VectorXd next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                               const Eigen::VectorXd& there, const BasisCoefficients& sd) const override;
  /// Yes: errors of the model cancel, so the posterior may be ten times narrower than usual finite differences.
  bool fits_effects_finely() const override { return true; }
  NearSteps near_steps(const ModelDiscrepancy& discrepancy) const override;
  std::size_t minors(const sim::Randomisation& /*uncertain*/) const override { return 0; }
  /// What sessions differ by. If the references do not cover all regimes, also what the model gets wrong in all
  /// flights.
  std::vector<Background> backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const override;
  void describe_rest(RobotFit& /*robot*/) const override {}
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;

  /// Linearises around the parameters of `reference`, which must not be null; `uncertain` and `options` are not used.
  RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
                     const ReferenceFit* reference) const override;
  /// If the references do not cover all regimes, effects of ModelDiscrepancy::of_models gain more by chance.
  VerdictRule rule(const RobotFit& robot, VerdictRule given) const override;
  /// That of no change at all since the references, not even by what sessions differ by.
  double log_evidence_of_none(const RobotFit& robot) const override;
  /// A change may follow another law than the catalogue's. Deviations from the law of a fitted effect, times a factor
  /// F, may then explain much of any change without the effect's magnitudes m. The F with the largest evidence counts.
  /// These deviations are t = F |m| / s times those of a harmless change of standard magnitude s. A harmless change has
  /// them at a cost; for the cheapest law factor f of its own, from 1 to LawPrior::most, it is
  ///   1/2 (log f / spread)^2 + 1/2 (t / f)^2    nats
  OtherLaws other_laws(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit) const override;
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  /// None: the parameters stay those of the references.
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return kMaxFurther; }
  /// By columns, without simulation. Also subtracts what changes between sessions and the model discrepancy explain, as
  /// learnt from the references and the other folds.
  std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                      const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                      int threads) const override;
  /// Refutes none.
  void refute(const RobotFit& /*robot*/, const Fitter& /*fitter*/, const Flights& /*flights*/,
              const VerdictRule& /*rule*/, Inference& /*d*/) const override {}
  /// Calls contrast_pool_of().
  std::string pool(const ScoredHypothesis& hypothesis) const override;
  void choose_predicting(Inference& d) const override;
  /// Calls with_effects(), then moves the parameters by their estimated change since the references, as sessions
  /// differ.
  CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                              const Inference& d) const override;
  /// None.
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;
  /// Calls changes_seen() (changes_seen.hpp).
  std::vector<SeenQuantity> seen(const RobotFit& robot) const override;
  /// With the parameters of the references, which are certain: rivals differ by their effects alone.
  Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
              const sim::Randomisation& as_filed) const override;
  /// Empty columns: the parameters are certain.
  std::vector<SharedColumn> known_columns(const Rival& rival, const std::optional<Fit>& first) const override;

 private:
  double min_step_nats_;
};

/// pool_of() (alone.hpp), except that the hypothesis none is in the pool of parameters: under both, nothing that
/// matters changed.
std::string contrast_pool_of(const ScoredHypothesis& hypothesis);

}  // namespace flappy::gap
