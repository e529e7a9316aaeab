#pragma once

#include <filesystem>
#include <string>

#include "io/installation.hpp"
#include "io/ranks.hpp"
#include "lab/benchmark/case_plan.hpp"
#include "lab/benchmark/change_over_sessions.hpp"
#include "lab/benchmark/families.hpp"

namespace flappy::benchmark {

struct MakeCommand {
  std::string family = "a";
  std::filesystem::path out, vehicle = io::config_path("vehicles/hummingbird_nominal.toml"),
                             randomise = io::config_path("randomisation/published.toml");
  PlanOptions plan;
  std::size_t other_sessions = kOtherSessions;  ///< that tell which effects count; 0: this is not computed
  int threads = 0;                              ///< 0: one for each processor
  io::Ranks* ranks = nullptr;
};

/// Flies the cases into `out`/cases and seals their labels. Resumes an interrupted run; false if interrupted again.
/// InputError if `out` has a benchmark with another plan.
bool make_bench(const MakeCommand& command);

}  // namespace flappy::benchmark
