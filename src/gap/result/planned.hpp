// The result of flappy-gap plan: what flights that were not flown yet would tell apart. Plain data, which plan.json
// holds (plan_json.hpp).
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
  /// Factor on the magnitudes from which on `probability` is 0.9, between 1/16 and 16. None: it is less up to 16, up to
  /// the largest magnitude that a vehicle file accepts, or up to one that diverges; or the plan is of the matrix alone.
  std::optional<double> sure_from;
  std::vector<double> nats;  ///< [rival of Plan::rivals] expected evidence over the rival; 0 over the effect itself
  std::vector<std::string> alike;  ///< rivals that keep more than a ninth of their odds against the effect
};

/// Another plan: other sensors, number of flights or manoeuvre, with or without references, or further flights after an
/// intervention. All else is as in the plan that was asked for.
struct PlannedChoice {
  std::string name, what;  ///< identifier; in words
  bool flies = true;       ///< whether the vehicle can fly it; if not, all else but the hours is empty
  /// How probable the diagnosis would find the effect that the robot has: mean over all effects of the catalogue; 0 for
  /// effects that are not seen.
  double probability = 0;
  double hours = 0;                 ///< hours of work that it takes beyond the plan that was asked for, or 0
  double gained_per_hour = 0;       ///< probability beyond that of the plan that was asked for, over these hours
  std::vector<std::string> named;   ///< effects that the diagnosis would find with a probability of one half or more
  std::vector<std::string> gained;  ///< effects in `named` for which the plan that was asked for is below one half
};

struct Plan {
  std::string vehicle, manoeuvre;  ///< file; name of what is flown, or the folders of the flights that it is like
  std::size_t flights = 0;         ///< number of test flights
  bool reference = false;  ///< whether reference flights are flown, too: as many, or PlanSettings::like_reference
  std::vector<std::string> rivals;     ///< effects that change a row, then "parameters": none of them
  std::vector<PlannedEffect> effects;  ///< in the order of the rivals, without those whose simulation diverges
  std::vector<std::string> unseen;     ///< all other effects of the catalogue: they change no row, or diverge
  /// Effects that the flights cannot tell apart, though they see them: each is `alike` to another of its group, and
  /// that one to it.
  std::vector<std::vector<std::string>> groups;
  std::vector<PlannedChoice> choices;  ///< the largest probability first; empty for a matrix alone, and for `like`
  bool complete = true;                ///< whether no choice is missing because the plan was stopped
};

}  // namespace flappy::gap
