// The result of flappy-gap plan: what flights that were not flown yet would tell apart. Plain data, which plan.json
// holds (plan_json.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// An effect of the catalogue, if the robot has it.
struct PlannedEffect {
  std::string effect, group;
  std::vector<Estimate> magnitudes;  ///< at which it is asked about; `low` and `high` are not used
  double probability = 0;            ///< that a diagnosis of the flights gives it
  std::optional<double> sure_from;   ///< factor on the magnitudes from which on that is 0.9; none: not up to 16
  std::vector<double> nats;          ///< [rival of Plan] expected evidence over the rival
  std::vector<std::string> alike;    ///< rivals that keep more than a ninth of its probability
};

/// Other flights in place of those that were asked about.
struct PlannedChoice {
  std::string name, what;
  bool flies = true;                ///< whether the vehicle can fly it
  double probability = 0;           ///< mean over all effects that it is given
  std::vector<std::string> named;   ///< effects that are given with a probability of at least one half
  std::vector<std::string> gained;  ///< effects in `named` that the flights asked about do not name
};

struct Plan {
  std::string vehicle, manoeuvre;                ///< file; name of what is flown, or the flights that it is like
  std::size_t flights = 0;                       ///< number of flights, and of reference flights
  bool reference = false;                        ///< whether as many reference flights are flown
  std::vector<std::string> rivals;               ///< the effects, then "parameters"
  std::vector<PlannedEffect> effects;            ///< in the order of the rivals
  std::vector<std::string> unseen;               ///< effects of the catalogue that change no row
  std::vector<std::vector<std::string>> groups;  ///< effects that nothing tells apart
  std::vector<PlannedChoice> choices;            ///< the most telling first
  bool complete = true;                          ///< whether no choice is missing because the plan was stopped
};

}  // namespace flappy::gap
