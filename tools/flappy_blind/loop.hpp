// flappy-blind loop: measures whether a diagnosis improves a policy. Each robot of a scored benchmark that has an effect, and flew rich
// flights, flies the escape with a policy whose training was continued on its corrected vehicle, and with the same policy whose
// training was continued for as long on the vehicle's file. Without a run to be trained on, policies fly as they are, robots need no
// diagnosis, and their effects stay sealed. Each policy flies with the controller of its own run.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace flappy::blind {

struct LoopCommand {
  std::vector<std::string> folders;  ///< benchmarks, one for each family; with `run` they have to be scored
  std::string run;                   ///< the training run whose best policy is trained further; empty: none is trained
  std::string out;
  std::vector<std::string> also;  ///< other training runs, whose best policies fly as they are
  std::string costly;  ///< a training run: only robots whose effect costs its best policy escapes; empty: all
  std::vector<std::string> overrides;  ///< replace keys of RUN/config/train.toml: "learn.updates=20000"
  std::size_t robots = 0;              ///< the first robots of each folder, at most; 0: all
  std::size_t escapes = 50;
  int threads = 0;  ///< number of robots in parallel; 0: one for each processor
};

/// Resumes where it was stopped; returns null if it is stopped again. Writes loop.csv, a line for each robot, and loop.md.
nlohmann::ordered_json run_loop(const LoopCommand& command);

}  // namespace flappy::blind
