// From flights to the probabilities of all hypotheses: the stages of a diagnosis.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/diagnose/verdict_rule.hpp"
#include "gap/evidence/robot_fit.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// A block of the model discrepancy that is larger than its prior allows: what no effect explains.
struct FreeBlock {
  int channel = 0, harmonic = 0;
  int function = 0;  ///< of the basis: the one that takes most of the block
  double times = 0;  ///< its scale over the robot's
  double gain_nats = 0;
};

/// A hypothesis with its evidence. Hypotheses exclude each other.
struct ScoredHypothesis {
  HypothesisKind kind = HypothesisKind::parameters;
  std::vector<std::string> effects;
  double log_evidence = 0;  ///< of all flights; includes log_prior
  double log_prior = 0;
  double probability = 0;
  std::vector<FreeBlock> unexplained;     ///< of an unknown cause, or of a remainder beside effects
  std::vector<std::string> jointly_with;  ///< effects that these blocks are fitted jointly with
  Fit fit;  ///< of effects and parameters. An effect that would gain nothing is fitted linearly, without a residual
  /// The largest deviation of an effect that acts by the place from the catalogue's law; none: it follows that law as far as any does.
  std::optional<FreeBlock> other_law;
  Residuals held_out;  ///< residual of each flight with the fit to the others, where it was fitted
  /// Effects of the hypothesis whose fit predicts for this one; those beyond its own are not told from chance. Empty: its own.
  std::vector<std::string> predicted_with;
  bool fitted() const { return fit.flown(); }
  bool has_remainder() const { return !unexplained.empty(); }
  /// Log evidence without the prior.
  double explained() const { return log_evidence - log_prior; }
};

struct InferenceOptions {
  int threads = 0;
  int max_finalists = 8;                                                ///< effects that are fitted by simulation
  int max_effects = 3;                                                  ///< that a hypothesis may combine
  std::vector<std::string> withheld;                                    ///< effects that the catalogue is to lack
  std::function<bool(double share, const std::string& what)> progress;  ///< false: no further effect is fitted
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  VerdictRule rule = read_verdict_rule();
};

/// What the stages found; a Diagnosis is its summary.
struct Inference {
  bool complete = true;                      ///< false: progress stopped it
  std::vector<ScoredHypothesis> hypotheses;  ///< the most probable first
  Verdict verdict;
  std::size_t concluded = 0;  ///< place of the most probable hypothesis of the verdict
  std::vector<std::string> untestable;
  Fit parameters;                      ///< without effects
  Eigen::VectorXd corrected;           ///< coordinates of what is concluded, without background magnitudes
  std::vector<double> minors;          ///< variates for sim::Randomisation::set_minors
  std::vector<SensorFinding> sensors;  ///< given what is concluded
  std::optional<Validation> validation;
  Residuals nominal;             ///< of the vehicle file
  Residuals refit;               ///< of the parameters alone: each flight with the fit to the others
  std::vector<double> noise_sd;  ///< [group] of rows of noise alone

  const ScoredHypothesis& conclusion() const { return hypotheses[concluded]; }
  /// The hypothesis whose fit predicts for the conclusion: the conclusion itself, or one with further effects.
  const ScoredHypothesis& predicting() const;
};

Inference infer(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options);

}  // namespace flappy::gap
