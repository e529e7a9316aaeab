#pragma once

#include <nlohmann/json.hpp>

#include "gap/next/plan.hpp"

namespace flappy::gap {

struct PlanCommand {
  PlanSettings settings;
  std::vector<std::string> magnitudes;  ///< EFFECT=FACTOR
  std::string out;                      ///< folder for plan.json and matrix.csv
};

/// Plans, prints, writes the files and returns the content of plan.json. io::InputError as from make_plan.
nlohmann::ordered_json run_plan(const PlanCommand& command);

}  // namespace flappy::gap
