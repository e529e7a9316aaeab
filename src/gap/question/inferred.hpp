// What the parts of a diagnosis hand to each other: options, hypotheses with their evidence, and all that is inferred.
// infer() (gap/answer/inference.hpp) fills an Inference; result_of() makes the Diagnosis of it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/question/verdict_rule.hpp"
#include "gap/result/diagnosis.hpp"
#include "gap/session/session_scatter.hpp"

namespace flappy::gap {

/// A block of the model discrepancy (gap/evidence/evidence.hpp) that exceeds its prior: no effect explains the residual
/// there. For other_law, a coefficient in which the law of an effect deviates.
struct FreeBlock {
  int channel = 0, harmonic = 0;  ///< harmonic: 0 is the mean
  int function = 0;               ///< index of the basis function that takes most of the block
  /// Scale of the block over that of the robot, in a contrast over that of the session; for other_law, the law factor.
  double times = 0;
  double gain_nats = 0;  ///< gain of evidence; for a free block, less the penalty of an unknown cause
};

/// A hypothesis with its fit. RankedHypothesis::group, remainder, parameters, loss and closure are empty here:
/// result_of() fills them (gap/answer/result.hpp).
struct ScoredHypothesis : RankedHypothesis {
  ScoredHypothesis() { kind = HypothesisKind::parameters; }
  std::vector<FreeBlock> unexplained;     ///< blocks of an unknown cause, or of a remainder in addition to the effects
  std::vector<std::string> jointly_with;  ///< effects with which these blocks are fitted jointly
  /// Only of a hypothesis of kind effect. Without a residual if its effects were fitted only linearly.
  Fit fit;
  /// The largest deviation of an effect from the catalogue's law, in a function of the place. None: the law factor does
  /// not exceed 1.
  std::optional<FreeBlock> other_law;
  /// Residuals of each test flight under the fit to the other test flights; of a lone flight under its own fit. In a
  /// contrast of a beat-averaged vehicle, under the fit to all. Empty if not fitted by simulation.
  TestResiduals held_out;
  /// If a likelier hypothesis has all effects of this one and more: its effects. Its fit is then used for predictions,
  /// though the further effects may be due to chance. Empty: its own fit is used.
  std::vector<std::string> predicted_with;
  /// Whether the effects were fitted by simulation.
  bool fitted() const { return fit.flown(); }
  bool has_remainder() const { return !unexplained.empty(); }
};

/// Parameters and effects of the corrected vehicle.
struct CorrectedParameters {
  std::vector<std::string> effects;  ///< those of Inference::predicting(), then those of background magnitudes alone
  Eigen::VectorXd at;                ///< coordinates of the Hypothesis of these effects
  std::vector<double> minors;        ///< variates for sim::Randomisation::set_minors
};

/// Log evidence of a hypothesis that is refuted, or whose vehicle cannot be simulated. Choice: less than any other.
inline constexpr double kRefuted = -1e9;
/// For a vehicle with wings, the number of effects that are fitted by simulation. Choice.
inline constexpr int kMaxFinalists = 8;
/// For a vehicle with wings, the largest number of effects in a hypothesis. Choice.
inline constexpr int kMaxEffects = 3;

/// read_request() makes these of the settings of a diagnosis.
struct InferenceOptions {
  int threads = 0;                                                      ///< as for io::parallel_for
  int max_finalists = kMaxFinalists;                                    ///< effects that are fitted by simulation
  int max_effects = kMaxEffects;                                        ///< largest number of effects in a hypothesis
  std::vector<std::string> withheld;                                    ///< effects to leave out of the catalogue
  std::function<bool(double share, const std::string& what)> progress;  ///< returns false to fit no further effect
  ModelDiscrepancy discrepancy;
  VerdictRule rule;
  SessionPrior sessions;  ///< only of a contrast of a beat-averaged vehicle
};

/// All that a diagnosis infers of one set of test flights.
struct Inference {
  bool complete = true;                      ///< false: stopped by `progress`
  std::vector<ScoredHypothesis> hypotheses;  ///< the most probable first
  Verdict verdict;
  std::size_t concluded = 0;  ///< index of the most probable hypothesis among those that the verdict stands for
  std::vector<std::string> untestable;  ///< effects that the logs cannot show
  Fit parameters;  ///< the parameters fitted without effects; in a contrast, to the reference flights
  CorrectedParameters corrected;
  std::vector<double> minors;  ///< variates for sim::Randomisation::set_minors, at which hypotheses are fitted
  /// Lag and errors of declared sensors, given predicting(); none in a contrast of a beat-averaged vehicle.
  std::vector<SensorFinding> sensors;
  std::optional<Validation> validation;  ///< only of a beat-averaged vehicle without references
  TestResiduals nominal;                 ///< of the vehicle file
  /// Without effects, with parameters fitted to the other test flights, a lone flight's to itself; in a contrast, with
  /// the parameters of the references (Contrast::held_out).
  TestResiduals refit;
  std::vector<SeenQuantity> seen;  ///< only in a contrast
  std::vector<OddFlight> odd;      ///< only in a contrast of a beat-averaged vehicle
  std::vector<double> noise_sd;    ///< [group] standard deviation of the noise of a row (gap/evidence/evidence.hpp)

  const ScoredHypothesis& conclusion() const { return hypotheses[concluded]; }
  /// The hypothesis whose fit predicts for the conclusion (ScoredHypothesis::predicted_with).
  const ScoredHypothesis& predicting() const;
};

/// What a contrast takes from its reference flights. Several sets of test flights may share it. Not to be moved or
/// copied: `fit` refers to `flights`.
struct ReferenceFit {
  ReferenceFit(const FlightList& references, const sim::Randomisation& uncertain, const InferenceOptions& options);
  Flights flights;  ///< the references, without tests
  RobotFit fit;     ///< as RobotFit::of_references
  /// For the corrected vehicle; if it has wings, with background magnitudes (corrected_without_effects).
  CorrectedParameters corrected;
};

/// Key under which a verdict adds up the probabilities of hypotheses that flights often cannot tell apart: the sorted
/// groups of the effects, joined by +: "body_drag+world_force". An effect without a group is its own group.
std::string pool_name(const std::vector<std::string>& effects);

/// A quantity that changed by more standard deviations between sessions than this is a change, whatever its cause. Choice.
inline constexpr double kPlainTimes = 7;
/// Whether any quantity changed by more than kPlainTimes; then the verdict may not be "unchanged".
bool changed_plainly(const std::vector<SeenQuantity>& seen);
/// Sets the probabilities of the hypotheses none and parameters, which in a contrast mean "unchanged", to 0, and those of
/// the others in proportion so that they add up to 1; sorts: the most probable first.
void exclude_unchanged(std::vector<ScoredHypothesis>& hypotheses);

/// Sets predicted_with of the conclusion: to the effects of the likeliest fitted hypothesis that contains the
/// conclusion's effects, if it is likelier. Its further effects may be due to chance, so they are not named; yet a
/// vehicle with them predicts better. The conclusion none keeps the file.
void predict_with_the_likeliest(Inference& d);

}  // namespace flappy::gap
