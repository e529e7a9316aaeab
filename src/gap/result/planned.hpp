// The result of flappy-gap plan: which effects planned flights would tell apart. Plain data, which plan.json holds
// (plan_json.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// What the flights would tell of an effect of the catalogue, if the robot has the effect.
struct PlannedEffect {
  std::string effect;
  std::string group;                 ///< the effect's group in the catalogue, or its own name; not one of Plan::groups
  std::vector<Estimate> magnitudes;  ///< at which the effect is asked about; `low` and `high` are not used
  double probability = 0;            ///< how probable the diagnosis finds the effect
  /// Smallest factor on the magnitudes, from 1/16 to 16, for which `probability` is 0.9 or more. None: not reached up
  /// to 16, up to the largest magnitude that a vehicle file accepts, or up to one whose simulation diverges; or only
  /// the matrix was asked for.
  std::optional<double> sure_from;
  std::vector<double> nats;  ///< [rival of Plan::rivals] expected evidence over the rival; 0 over the effect itself
  std::vector<std::string> alike;  ///< rivals that keep more than a ninth of their odds against the effect
};

/// A plan that differs in one choice from the plan that was asked for, such as sensors, number of flights, manoeuvre,
/// references, or further flights after an intervention.
struct PlannedChoice {
  std::string name, what;  ///< identifier; in words
  bool flies = true;       ///< whether the vehicle can fly it; if not, all else but the hours is empty
  /// Probability that the diagnosis would give the effect that the robot has: mean over all effects of the catalogue,
  /// of which those that the flights do not show count as 0.
  double probability = 0;
  double hours = 0;                 ///< hours of work that it takes in addition to the plan asked for, or 0
  double gained_per_hour = 0;       ///< gain of `probability` over the plan asked for, per hour; 0 without hours
  std::vector<std::string> named;   ///< effects that the diagnosis would find with a probability of one half or more
  std::vector<std::string> gained;  ///< effects in `named` for which the plan that was asked for is below one half
};

struct Plan {
  std::string vehicle, manoeuvre;  ///< vehicle file; name of the manoeuvre, or the folders of PlanSettings::like
  std::size_t flights = 0;         ///< number of test flights
  bool reference = false;  ///< whether reference flights are flown, too: as many, or PlanSettings::like_reference
  std::vector<std::string> rivals;     ///< effects that change a row, then "parameters": no effect
  std::vector<PlannedEffect> effects;  ///< in the order of the rivals, without those whose simulation diverges
  std::vector<std::string> unseen;     ///< all other effects of the catalogue: they change no row, or diverge
  /// Groups of effects that the flights show but cannot tell apart: each effect has another one of its group in
  /// `alike`, and is in `alike` of that one.
  std::vector<std::vector<std::string>> groups;
  std::vector<PlannedChoice> choices;  ///< the largest probability first; empty for a matrix alone, and for `like`
  bool complete = true;                ///< whether no choice is missing because the plan was stopped
};

}  // namespace flappy::gap
