// The shipped search, made small.
#pragma once

#include "design/study.hpp"
#include "vehicles.hpp"

namespace flappy::design {

inline DesignConfig small_config(std::vector<std::string> more = {}) {
  std::vector<std::string> overrides = {"flights.hover=8",     "flights.escape=8",     "flights.effects=1",
                                        "search.population=8", "search.generations=2", "verify.vehicles=16"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return read_design_config(test::source_path("configs/design/hummingbird.toml"), overrides);
}

}  // namespace flappy::design
