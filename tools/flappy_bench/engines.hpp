// Training on each engine, as a user starts it: flappy-train as a process of its own.
#pragma once

#include <string>
#include <vector>

#include "speed.hpp"

namespace flappy::bench {

struct EngineRow {
  std::string name, engine, program;
  double start_s = 0;     ///< wall time of a run of one step, most of which is starting
  double peak_bytes = 0;  ///< of memory, of a whole run
  Figure updates_per_s;   ///< of whole runs, evaluations left out
  Figure to_90_s;         ///< wall time until 90 % succeed, over the seeds that reach it
  Figure times_lanes;  ///< of to_90_s, seed by seed, by that of the first row; for the second, where all seeds reach it
  Figure best_success;
  int reached = 0;  ///< seeds that reach it
};

/// configs/train/escape.toml on lanes and, seed by seed in turn, in the flappy-train of another build, `beside`; where none is given, on
/// LibTorch, if this build has it. io::InputError where flappy-train fails.
std::vector<EngineRow> measure_engines(int seeds, const std::string& beside);

}  // namespace flappy::bench
