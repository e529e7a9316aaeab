// From flight logs to what is missing in the model: fits the uncertain parameters, then every effect of the catalogue
// beside them, and weighs what is left.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/diagnose/verdict_rule.hpp"
#include "gap/evidence/fit.hpp"

namespace flappy::gap {

/// What no entry explains: a smooth function of the regime, in a channel and a harmonic of the beat, or in all of them.
struct Term {
  int channel = kAll, harmonic = kAll;
  int function = 0;  ///< of the basis
  double times = 0;  ///< how much larger it may be than what every model gets wrong
  double gain = 0;   ///< nats
  static constexpr int kAll = -1;
  bool has(int group) const {
    return (channel == kAll || group / kCoefficients == channel) &&
           (harmonic == kAll || (group % kCoefficients + 1) / 2 == harmonic);
  }
};

/// What explains the flights, one of several hypotheses that exclude each other.
struct ScoredHypothesis {
  enum class Kind { none, parameters, effect, unknown } kind = Kind::parameters;
  std::vector<std::string> effects;
  double log_evidence = 0;  ///< of all flights
  double probability = 0;
  std::vector<Term> terms;                ///< of an unknown cause
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
};

struct Diagnosis {
  bool complete = true;                      ///< false: progress had it stop before every effect was weighed
  std::vector<ScoredHypothesis> hypotheses;  ///< most probable first
  Conclusion conclusion;
  Fit parameters;                ///< without any effect
  Residuals nominal;             ///< what is left of the measurement with the vehicle's file
  Residuals refit;               ///< with parameters alone: in each flight what is left with the fit to the others
  std::vector<double> noise_sd;  ///< [group] of the rows of noise alone, as found
};

Diagnosis diagnose(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options);

}  // namespace flappy::gap
