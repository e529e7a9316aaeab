#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lab/benchmark/predict/predict.hpp"
#include "lab/benchmark/score_statistics.hpp"

namespace flappy::benchmark {

struct CaseTruth {
  std::string part;                            ///< one of kParts or kContrastParts
  std::vector<std::string> effects;            ///< effects of the robot
  std::vector<std::string> channels, regimes;  ///< where the effects act (blind::FamilyEffect)
  std::uint64_t seed = 0, draw = 0;            ///< identify the robot
  std::vector<double> over_sessions;           ///< of each effect (change_over_sessions.hpp); empty: not known
  /// Whether each of its effects changes the flights by more than sessions and noise do; also where it is not known.
  bool counts() const;
};
/// Parts of a benchmark, by their robots. Those with effects have independent parameters and, but for redeclared,
/// inexact declarations.
///   singles, singles_current  one effect; singles_current also logs currents
///   redeclared                the robots of singles, with exact declarations
///   none, parameters, own_parameters, conventions
///                             no effect: as the vehicle file; parameters of the published randomisation; each
///                             parameter of each body independent; declarations within the habits of laboratories
///   withheld, outside         an effect whose group is withheld from the catalogue; one never in the catalogue
///   pairs, hover              two effects of different groups; an effect that hover alone does not show, in hover
///   singles_bench, own_parameters_bench
///                             the robots of singles and of own_parameters, also clamped on a bench and filmed
inline constexpr const char* kParts[] = {
    "singles",  "singles_current", "redeclared", "none",  "parameters",    "own_parameters",      "conventions",
    "withheld", "outside",         "pairs",      "hover", "singles_bench", "own_parameters_bench"};
/// Parts of a contrast. All robots have independent parameters and inexact declarations; their tests are of another
/// session than their references.
///   changed, changed_pairs    one effect, and two of different groups, at 0.7 to 2 times typical magnitude
///   changed_short_reference, changed_short_test
///                             the robots of changed with one reference or one test flight of 10 s
///   unchanged                 no effect
///   changed_calm, unchanged_calm
///                             references that hover and follow slow paths; one effect at 0.7 to 2 times typical magnitude, and none
///   changed_withheld, changed_outside
///                             an effect whose group is withheld, at 0.7 to 2 times typical magnitude; one never in the catalogue, at 2
inline constexpr const char* kContrastParts[] = {
    "changed",        "changed_short_reference", "changed_short_test", "unchanged",    "changed_calm",
    "unchanged_calm", "changed_withheld",        "changed_outside",    "changed_pairs"};

/// Place of an unknown cause, in the terms of blind::FamilyEffect.
struct Where {
  std::string channel, regime;
};

/// A plan's expectation for a case, given its true effect.
struct Foresight {
  double nats = 0;         ///< expected evidence for the true effect over its best rival
  double probability = 0;  ///< that the diagnosis gives the true effect
};

struct Answer {
  /// Kind of the verdict; "remainder": effects and a remainder; "crashed": the robot crashed in the flight to be
  /// diagnosed.
  std::string kind = "data";
  std::vector<std::string> effects;               ///< effects that the verdict names; for a group, its possible effects
  double probability = 0;                         ///< probability of the verdict
  std::vector<gap::RankedHypothesis> hypotheses;  ///< all
  /// Those with effects, the most probable first; with and without a remainder together.
  std::vector<gap::RankedHypothesis> sets;
  std::vector<std::string> suspects;  ///< most probable effects given that one is missing
  double none = 0, parameters = 0, unknown = 0;
  std::optional<double> nominal, refit, floor;  ///< mean losses: vehicle file, parameters fitted, noise alone
  std::map<std::string, Rival> rivals;
  std::string manoeuvre;  ///< the proposed flight; empty: none
  std::optional<Where> where;
};
Answer answer_of(const Prediction& prediction);
bool abstains(const Answer& answer);

struct ScoredCase {
  CaseTruth truth;
  Answer prediction;
  /// Answer with only the true effects in the catalogue, if `prediction` did not fit them.
  std::optional<Answer> true_fit;
  /// Answer for the flights and the flight that `prediction` proposed.
  std::optional<Answer> after_next;
  std::optional<Foresight> foreseen;  ///< none: not planned, several effects, or one that changes no row
};

struct ScoreLine {
  std::string key, what, must, aim;
  ScoreValue score;
  std::optional<bool> meets_must, meets_aim;
  /// The best rival at the diagnosis' own share of false alarms; none: the score applies to no rival.
  std::optional<ScoreValue> rival;
  std::string rival_name;
};

struct Scores {
  std::vector<ScoreLine> lines;
  std::vector<std::string> beaten_on;  ///< keys of rows on which a rival is better
  /// Share of harmless robots at which a rival raises an alarm if all that it says counts.
  std::map<std::string, ScoreValue> unbounded_alarms;
};

Scores score(const std::vector<ScoredCase>& cases);

/// Of a pair of effects of which sessions hide one, the case of the other: to name the hidden one is neither asked nor
/// wrong. Any other case as it is.
ScoredCase by_what_counts(ScoredCase c);

/// Whether the verdict is right for a case of its part.
bool right(const CaseTruth& truth, const Answer& prediction);

/// Share of the closable gap that the verdict closes: (E_refit - E_named) / (E_refit - E_true effect refitted), E: mean
/// loss. 0 for a verdict without effects; none if the true effect gains less than two standard deviations.
std::optional<double> closure(const ScoredCase& c);

/// Whether the closure of a case is scored but its true effect was not fitted, so that true_fit is needed.
bool needs_true_fit(const ScoredCase& c);

/// Evidence of a diagnosis for the true effect over its best rival, nats: of hypotheses with it, alone or with others,
/// over those without. None unless the robot has one effect and the diagnosis weighed it.
std::optional<double> realised_nats(const ScoredCase& c);

}  // namespace flappy::benchmark
