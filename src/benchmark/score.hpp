// How good the diagnoses of a blind benchmark were: what was predicted against what was so.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "benchmark/predict/predict.hpp"
#include "benchmark/score_statistics.hpp"

namespace flappy::benchmark {

/// What was so.
struct CaseTruth {
  std::string part;                           ///< of kParts
  std::vector<std::string> effects;           ///< that the robot had
  bool separable = true;                      ///< whether flappy-blind detectability could tell it from every rival
  std::map<std::string, double> true_values;  ///< by "effect.parameter", where the catalogue's form has one
};
inline constexpr const char* kParts[] = {"singles",  "singles_current", "none",  "parameters",
                                         "withheld", "pairs",           "hover", "typical"};

struct ScoredCase {
  CaseTruth truth;
  Prediction prediction;
  /// With the true effect alone in the catalogue, where `prediction` has not fitted it.
  std::optional<Prediction> true_fit;
};

/// One line of the table.
struct ScoreLine {
  std::string key, what, must, aim;
  ScoreValue score;
  std::optional<bool> meets_must, meets_aim;
  std::map<std::string, ScoreValue> baselines;  ///< those that can be judged by it
};

struct Scores {
  std::vector<ScoreLine> main, typical;
  double ece_calibrated_95 = 0, typical_ece_calibrated_95 = 0;
};

Scores score(const std::vector<ScoredCase>& cases);

/// Whether the verdict is what it should be.
bool right(const CaseTruth& truth, const Prediction& prediction);

/// Share of the closable gap that the verdict closes: (E_refit - E_named) / (E_refit - E_true effect refitted); 0 for a
/// verdict without effects; nothing where the true effect's own gain is below two of its sd.
std::optional<double> closure(const ScoredCase& c);

/// Whether closure is asked of a case whose true effect was not fitted.
bool needs_true_fit(const ScoredCase& c);

}  // namespace flappy::benchmark
