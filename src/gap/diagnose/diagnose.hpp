// From flight logs to what is missing in the model: fits the uncertain parameters, then every effect of the catalogue
// beside them, and weighs what is left.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/diagnose/verdict_rule.hpp"
#include "gap/evidence/robot_fit.hpp"

namespace flappy::gap {

/// What no entry explains: a block of the discrepancy that is larger than models are wrong by.
struct Term {
  int channel = 0, harmonic = 0;
  int function = 0;  ///< of the basis, the one that takes most of the block
  double times = 0;  ///< how much larger it is than usual for this robot
  double gain = 0;   ///< nats
};

/// What explains the flights, one of several hypotheses that exclude each other.
struct ScoredHypothesis {
  enum class Kind { none, parameters, effect, unknown } kind = Kind::parameters;
  std::vector<std::string> effects;
  double log_evidence = 0;  ///< of all flights, and what was thought before
  double probability = 0;
  double log_prior = 0;
  std::vector<Term> terms;                ///< of an unknown cause, or of what is left beside effects
  std::vector<std::string> jointly_with;  ///< of an unknown cause: effects that its terms act jointly with
  /// Of effects and parameters. An effect that would gain nothing is weighed as far as a linear model sees: no residual, and
  /// its size is what flights that tell nothing of it leave probable.
  Fit fit;
  Residuals left;  ///< of an effect that was fitted: in each flight what is left with the fit to the others
  bool fitted() const { return !fit.point.residual.empty(); }
};

struct DiagnoseOptions {
  int threads = 0;
  int finalists = 8;  ///< effects that are fitted in full
  int most_effects = 3;
  std::vector<std::string> withheld;                                    ///< entries that the catalogue is to lack
  std::function<bool(double share, const std::string& what)> progress;  ///< false: no further effect is fitted
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  VerdictRule rule = read_verdict_rule();
};

/// What is claimed of the hypotheses.
struct Conclusion {
  enum class Kind { effect, group, parameters, none, unknown, data } kind = Kind::unknown;
  std::vector<std::string> effects;  ///< of a group: of its sets that hold a twentieth of it
  double probability = 0;            ///< of a group: all of it
  std::size_t hypothesis = 0;        ///< the most probable one of what is concluded
  bool remainder = false;            ///< beside effects something is left that no entry explains
};

struct Diagnosis {
  bool complete = true;                      ///< false: progress had it stop before every effect was weighed
  std::vector<ScoredHypothesis> hypotheses;  ///< most probable first
  Conclusion conclusion;
  Fit parameters;                      ///< without any effect
  std::vector<double> minors;          ///< variates of the vehicle's minor draws, for sim::Randomisation::set_minors
  std::vector<SensorFinding> sensors;  ///< beside what is concluded
  Residuals nominal;                   ///< what is left of the measurement with the vehicle's file
  Residuals refit;               ///< with parameters alone: in each flight what is left with the fit to the others
  std::vector<double> noise_sd;  ///< [group] of the rows of noise alone, as found
};

Diagnosis diagnose(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options);

}  // namespace flappy::gap
