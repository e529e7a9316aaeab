// From flight logs to what is missing in the model: fits the uncertain parameters, then every effect of the catalogue
// beside them, and weighs what is left.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/diagnose/verdict_rule.hpp"
#include "gap/evidence/robot_fit.hpp"

namespace flappy::gap {

/// What no entry explains: a block of the discrepancy (of the place, within the beat) that is larger than models are wrong by.
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
  /// Of effects that act by the place: where most otherwise than their entries say; none: as these say, up to what any law may be off.
  std::optional<Term> otherwise;
  Residuals left;  ///< of an effect that was fitted: in each flight what is left with the fit to the others
  /// Effects of the hypothesis whose fit flies this one; those beyond its own are not told from chance. Empty: its own.
  std::vector<std::string> flown_with;
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

/// What is left of a channel in flights that were held out.
struct HeldOutError {
  std::string channel;
  double rms = 0, low = 0, high = 0;  ///< 90 % of draws of blocks with replacement lie between
  double by_type = 0;  ///< the same with all flights of a kind held out together: those whose names differ by a number
};

/// What a laboratory asks of an effect before it believes it.
struct Validation {
  /// The vehicle's file, its parameters fitted, and then one effect upon the other, as they were found.
  struct Rung {
    std::string added;
    std::vector<HeldOutError> errors;
  };
  std::vector<Rung> ladder;
  /// Of the last rung: an effect's part in it, and copies of that part shifted in time, which should gain nothing.
  struct Control {
    std::string effect, channel;  ///< where it gains most
    double gain = 0;              ///< share of the rms that it takes away
    double best_of_shifted = 0;   ///< the same of the best copy
  };
  std::vector<Control> controls;
  /// A size as each flight alone has it.
  struct Agreement {
    std::string name;
    std::vector<double> value, sd;  ///< [flight]
    double p_value = 1;             ///< that these are one number
  };
  std::vector<Agreement> agreements;
};

struct Diagnosis {
  bool complete = true;                      ///< false: progress had it stop before every effect was weighed
  std::vector<ScoredHypothesis> hypotheses;  ///< most probable first
  Conclusion conclusion;
  std::vector<std::string>
      untestable;                      ///< entries that cannot show in these logs, of a robot that is known by the beat
  Fit parameters;                      ///< without any effect
  Eigen::VectorXd corrected;           ///< coordinates of what was concluded, of a robot that has nothing else
  std::vector<double> minors;          ///< variates of the vehicle's minor draws, for sim::Randomisation::set_minors
  std::vector<SensorFinding> sensors;  ///< beside what is concluded
  std::optional<Validation> validation;  ///< of a robot that is known by the beat
  Residuals nominal;                     ///< what is left of the measurement with the vehicle's file
  Residuals refit;               ///< with parameters alone: in each flight what is left with the fit to the others
  std::vector<double> noise_sd;  ///< [group] of the rows of noise alone, as found
};

/// Whose fit is that of what was concluded: of the hypothesis itself, or of one with a background beside its effects.
const ScoredHypothesis& flown(const Diagnosis& diagnosis);

Diagnosis diagnose(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options);

}  // namespace flappy::gap
