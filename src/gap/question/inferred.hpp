// What the parts of a diagnosis hand to each other: options, hypotheses with their evidence, and all that is inferred.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/question/verdict_rule.hpp"
#include "gap/result/diagnosis.hpp"
#include "gap/session/session_scatter.hpp"

namespace flappy::gap {

/// A block of the model discrepancy that exceeds its prior: the residual there is explained by no effect.
struct FreeBlock {
  int channel = 0, harmonic = 0;
  int function = 0;      ///< index of the basis function that takes most of the block
  double times = 0;      ///< scale of the block over that of the robot; for other_law, the law factor
  double gain_nats = 0;  ///< gain of evidence; for a free block, less the penalty of an unknown cause
};

/// A hypothesis with its fit. Its parameters, loss and closure are left to the result (diagnose/result.hpp).
struct ScoredHypothesis : RankedHypothesis {
  ScoredHypothesis() { kind = HypothesisKind::parameters; }
  std::vector<FreeBlock> unexplained;     ///< blocks of an unknown cause, or of a remainder in addition to the effects
  std::vector<std::string> jointly_with;  ///< effects with which these blocks are fitted jointly
  Fit fit;                                ///< effects and parameters; without a residual if fitted only linearly
  /// The largest deviation of an effect by the place from the catalogue's law. None: the law factor does not exceed 1.
  std::optional<FreeBlock> other_law;
  Residuals held_out;  ///< [test flight], fitted to the others, a lone one to itself; empty if not fitted by simulation
  /// Effects of another hypothesis whose fit predicts for this one: its own effects and further ones, whose gain may be
  /// due to chance. Empty: its own fit predicts.
  std::vector<std::string> predicted_with;
  bool fitted() const { return fit.flown(); }
  bool has_remainder() const { return !unexplained.empty(); }
};

/// Parameters and effects of the corrected vehicle.
struct CorrectedParameters {
  std::vector<std::string> effects;  ///< those of Inference::predicting(), then those of background magnitudes alone
  Eigen::VectorXd at;                ///< coordinates of their Hypothesis
  std::vector<double> minors;        ///< variates for sim::Randomisation::set_minors
};

/// Log evidence of a hypothesis that is refuted, or whose vehicle cannot be simulated. Choice: less than any other.
inline constexpr double kRefuted = -1e9;
/// Number of effects that are fitted by simulation, of a vehicle with wings. Choice.
inline constexpr int kMaxFinalists = 8;
/// Largest number of effects in a hypothesis, of a vehicle with wings. Choice.
inline constexpr int kMaxEffects = 3;

struct InferenceOptions {
  int threads = 0;
  int max_finalists = kMaxFinalists;                                    ///< effects that are fitted by simulation
  int max_effects = kMaxEffects;                                        ///< largest number of effects in a hypothesis
  std::vector<std::string> withheld;                                    ///< effects to leave out of the catalogue
  std::function<bool(double share, const std::string& what)> progress;  ///< returns false to fit no further effect
  ModelDiscrepancy discrepancy;
  VerdictRule rule;
  SessionPrior sessions;
};

struct Inference {
  bool complete = true;                      ///< false: stopped by `progress`
  std::vector<ScoredHypothesis> hypotheses;  ///< the most probable first
  Verdict verdict;
  std::size_t concluded = 0;            ///< index of the most probable hypothesis of the verdict
  std::vector<std::string> untestable;  ///< effects that change no row
  Fit parameters;                       ///< the parameters fitted without effects
  CorrectedParameters corrected;
  std::vector<double> minors;          ///< variates for sim::Randomisation::set_minors, at which hypotheses are fitted
  std::vector<SensorFinding> sensors;  ///< errors of declared sensors, given the conclusion
  std::optional<Validation> validation;  ///< only for a beat-averaged vehicle
  Residuals nominal;                     ///< [test flight] residuals of the vehicle file
  /// [test flight] Residuals with parameters fitted to the other flights, without effects.
  Residuals refit;
  std::vector<SeenQuantity> seen;  ///< only in a contrast
  std::vector<OddFlight> odd;
  std::vector<double> noise_sd;  ///< [channel and coefficient of the beat] standard deviation of the noise of a row

  const ScoredHypothesis& conclusion() const { return hypotheses[concluded]; }
  /// The hypothesis whose fit predicts for the conclusion (ScoredHypothesis::predicted_with).
  const ScoredHypothesis& predicting() const;
};

/// What a contrast takes from its reference flights.
struct ReferenceFit {
  ReferenceFit(const FlightList& references, const sim::Randomisation& uncertain, const InferenceOptions& options);
  Flights flights;                ///< the references, without tests
  RobotFit fit;                   ///< as RobotFit::of_references
  CorrectedParameters corrected;  ///< without effects
};

/// Sorted groups of the effects, joined by +: "body_drag+world_force". An effect without a group is its own group.
std::string pool_name(const std::vector<std::string>& effects);

/// Sets predicted_with of the conclusion to the effects of the likeliest hypothesis that contains its own. Further
/// effects may be due to chance, so they are not named; yet a vehicle with them predicts better.
void predict_with_the_likeliest(Inference& d);

}  // namespace flappy::gap
