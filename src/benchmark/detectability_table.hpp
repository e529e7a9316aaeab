// flappy-blind detectability.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "io/installation.hpp"

namespace flappy::benchmark {

struct DetectabilityCommand {
  std::string family;  ///< empty: A, as a diagnosis sees it; else by family_detectability.hpp
  std::string vehicle = io::config_path("vehicles/hummingbird_nominal.toml"),
              randomise = io::config_path("randomisation/published.toml"), priors = io::config_path("gap/priors.toml"),
              out;
  int vehicles = 8;
  std::uint64_t seed = 2001;  ///< of the first
  int threads = 0;            ///< 0: one for each processor
};

/// Finds, prints and writes how large effects have to be; the machine-readable result.
nlohmann::ordered_json run_detectability(const DetectabilityCommand& command);

}  // namespace flappy::benchmark
