// flappy-blind make.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "benchmark/families.hpp"
#include "benchmark/plan.hpp"
#include "io/installation.hpp"
#include "io/ranks.hpp"

namespace flappy::benchmark {

struct MakeCommand {
  std::string family = "a";
  std::filesystem::path out, vehicle = io::config_path("vehicles/hummingbird_nominal.toml"),
                             randomise = io::config_path("randomisation/published.toml"),
                             detectable;  ///< the latter: empty for the family's own
  PlanOptions plan;
  int threads = 0;  ///< 0: one for each processor
  io::Ranks* ranks = nullptr;
  /// What of the catalogue's parameters comes nearest to the effects of a case, by "effect.parameter"; null: nothing does.
  /// Asked of the parts whose intervals are scored; without it none is.
  std::function<std::map<std::string, std::optional<double>>(const blind::Assignment&,
                                                             const std::vector<blind::BlindEffect>&)>
      true_values;
};

/// Flies the cases into `out`/cases and seals what they are. Goes on where it was stopped; false where it was stopped again.
bool make_bench(const MakeCommand& command);

}  // namespace flappy::benchmark
