// flappy-gap blind make.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "blind/flights.hpp"
#include "blind_plan.hpp"

namespace flappy::gap {

struct MakeCommand {
  std::filesystem::path out, vehicle = FLAPPY_CONFIGS "/vehicles/hummingbird_nominal.toml",
                             randomise = FLAPPY_CONFIGS "/randomisation/published.toml",
                             detectable = FLAPPY_CONFIGS "/gap/detectable.toml";
  PlanOptions plan;
  int threads = 0;  ///< 0: one for each processor
  /// What of the catalogue's parameters comes nearest to the effects of a case, by "effect.parameter"; null: nothing does.
  /// Asked of the parts whose intervals are scored; without it none is.
  std::function<std::map<std::string, std::optional<double>>(const blind::Case&,
                                                             const std::vector<blind::BlindEffect>&)>
      true_values;
};

/// Flies the cases into `out`/cases and seals what they are. Goes on where it was stopped; false where it was stopped again.
bool blind_make(const MakeCommand& command);

}  // namespace flappy::gap
