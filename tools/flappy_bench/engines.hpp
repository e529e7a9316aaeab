// Speed of training on each engine. It runs flappy-train as a separate process, as a user does.
#pragma once

#include <string>
#include <vector>

#include "speed.hpp"

namespace flappy::bench {

struct EngineRow {
  std::string name, engine, program;
  double start_s = 0;     ///< wall time of a run of one step, almost all of it start-up
  double peak_bytes = 0;  ///< peak memory of a whole run
  Figure updates_per_s;   ///< of whole runs, without evaluations
  Figure to_90_s;         ///< wall time until 90 % succeed, over the seeds that reach it
  Figure times_lanes;  ///< to_90_s over that of the first row, seed by seed; second row only, if all seeds reach 90 %
  Figure best_success;
  int reached = 0;  ///< number of seeds that reach 90 %
};

/// Trains configs/train/escape.toml on lanes and, alternating by seeds, in the flappy-train of another build, `beside`. If `beside` is
/// empty, the second engine is LibTorch, if this build has it. Throws io::InputError if flappy-train fails.
std::vector<EngineRow> measure_engines(int seeds, const std::string& beside);

}  // namespace flappy::bench
