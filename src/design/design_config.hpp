// Configuration of a search, as configs/design/*.toml.
//
//   schema = 1
//   vehicle, motors = "file"              the published robot; a catalogue of motors
//   hover, escape = "file"                flights (rollout/fly_config.hpp) by a cascaded PID; their vehicle is not used
//   [built] and [workshop]                design/robot.hpp
//   [vary.NAME]                           low, high, step (optional); vary.motor = ["name", ...]
//   [[objective]]                         figure = "hover_power_W": any figure of design/judge.hpp
//   [[limit]]                             figure, at_least or at_most
//   [flights]                             hover, escape, effects: number of vehicles drawn for each design
//   [search]                              method = "nsga2" | "random", population, generations, seed, threads (0: all)
//   [verify]                              what follows for some designs of the front:
//   designs, vehicles, step_s             how many; flown again with vehicles drawn anew, and once more with this step
//   tune = "file", generations            what flappy-tune reads; its trials are flown by the design. 0: no tuning
#pragma once

#include "design/search.hpp"
#include "rollout/tune.hpp"

namespace flappy::design {

struct VerifyConfig {
  rollout::TuneConfig tune;  ///< gains and trials; its generations may be 0
  std::size_t designs = 0, vehicles = 0;
  double step_s = 0;
};

struct DesignConfig {
  JudgeConfig judge;
  SearchConfig search;
  VerifyConfig verify;
  std::string resolved;  ///< text of the configuration, overrides applied
};

/// Throws io::InputError for anything that is missing, unknown, out of range or inconsistent.
DesignConfig read_design_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::design
