// flappy-blind loop: whether a diagnosis pays. Each robot of a scored benchmark that has something wrong, and flew rich flights, flies the escape
// with a policy trained on with its corrected vehicle, and with the same policy trained on as long with the vehicle's file.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/installation.hpp"

namespace flappy::blind {

struct LoopCommand {
  std::vector<std::string> folders;  ///< of flappy-blind score, each of another family
  std::string run;                   ///< whose best policy is trained on
  std::string out;
  std::string train = io::config_path("train/escape.toml"), config = io::config_path("fly/escape.toml");
  std::vector<std::string> overrides;  ///< of `train`: "learn.updates=20000"
  std::size_t robots = 0;              ///< of each folder at most, the first; 0: all
  std::size_t escapes = 50;
  int threads = 0;  ///< robots at a time; 0: one for each processor
};

/// Goes on where it was stopped; null where it was stopped again. Writes loop.csv, a line for each robot, and loop.md.
nlohmann::ordered_json run_loop(const LoopCommand& command);

}  // namespace flappy::blind
