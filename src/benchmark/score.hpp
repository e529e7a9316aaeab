// How good the diagnoses of a blind benchmark were: what was predicted against what was so.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "benchmark/predict/predict.hpp"
#include "benchmark/score_statistics.hpp"

namespace flappy::benchmark {

/// What was so.
struct CaseTruth {
  std::string part;                            ///< of kParts
  std::vector<std::string> effects;            ///< that the robot had
  std::map<std::string, double> true_values;   ///< by "effect.parameter", where the catalogue's form has one
  std::vector<std::string> channels, regimes;  ///< where they act, as blind::FamilyEffect has it
  std::uint64_t seed = 0, draw = 0;            ///< of the robot
};
/// What their robots are:
///   singles, singles_current  one effect at twice its detectable size; the latter with currents
///   redeclared                the robots of singles, declared exactly
///   typical                   one effect at size 1, of those that are detectable there
///   none, parameters, own_figures, conventions
///                             no effect: as the file has it; of the published randomisation; every figure apart; other declarations
///   withheld, outside         an effect whose group the catalogue lacks; one that no catalogue has
///   pairs                     two of different groups
///   hover                     what hover alone does not show
/// All with effects have figures of their own and the conventions of some laboratory.
inline constexpr const char* kParts[] = {"singles",  "singles_current", "redeclared",  "typical",
                                         "none",     "parameters",      "own_figures", "conventions",
                                         "withheld", "outside",         "pairs",       "hover"};

/// A parameter of an effect with its 90 % interval.
struct ScoredParameter {
  double value = 0, low = 0, high = 0;
};

/// A set of effects that was weighed, with or without a remainder.
struct FittedSet {
  std::vector<std::string> effects;
  double probability = 0;
  std::map<std::string, ScoredParameter> values;  ///< by "effect.parameter"
  std::optional<double> left;                     ///< mean loss in flights held out
  double gain_sd = 0;                             ///< standard deviation of its gain over the parameters alone
};

/// Where an unknown cause acts, in the words of blind::FamilyEffect.
struct Where {
  std::string channel, regime;
};

/// A prediction as it is scored.
struct Answer {
  /// Of the verdict; "remainder": effects and something unknown; "crashed": there was no flight to diagnose.
  std::string kind = "data";
  std::vector<std::string> effects;  ///< of a group the rivals
  double probability = 0;            ///< of the verdict
  std::vector<FittedSet> sets;       ///< the most probable first
  double none = 0, parameters = 0, unknown = 0;
  std::optional<double> nominal, refit, floor;  ///< losses
  std::map<std::string, Baseline> baselines;    ///< by kBaselines
  std::vector<double> features;
  std::string manoeuvre;  ///< proposed by a verdict that abstains; or none
  std::optional<Where> where;
};
Answer answer_of(const Prediction& prediction);
bool abstains(const Answer& answer);

struct ScoredCase {
  CaseTruth truth;
  Answer prediction;
  /// With the true effect alone in the catalogue, where `prediction` has not fitted it.
  std::optional<Answer> true_fit;
  /// Of the flights, and of the one that `prediction` proposed.
  std::optional<Answer> after_next;
};

/// One line of the table.
struct ScoreLine {
  std::string key, what, must, aim;
  ScoreValue score;
  std::optional<bool> meets_must, meets_aim;
  std::map<std::string, ScoreValue> baselines;  ///< those that can be judged by it
};

struct Scores {
  std::vector<ScoreLine> lines;
  /// Lines that a baseline within the bar of false alarms is not beaten on by more than a standard error of the difference, by its
  /// name; none: beaten on all. Without those beyond the bar.
  std::map<std::string, std::vector<std::string>> unbeaten;
};

Scores score(const std::vector<ScoredCase>& cases);

/// Whether the verdict is what it should be.
bool right(const CaseTruth& truth, const Answer& prediction);

/// Share of the closable gap that the verdict closes: (E_refit - E_named) / (E_refit - E_true effect refitted); 0 for a
/// verdict without effects; nothing where the true effect's own gain is below two of its sd.
std::optional<double> closure(const ScoredCase& c);

/// Whether closure is asked of a case whose true effect was not fitted.
bool needs_true_fit(const ScoredCase& c);

}  // namespace flappy::benchmark
