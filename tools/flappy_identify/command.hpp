// The subcommands of flappy-identify, one file each.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>

#include "io/program.hpp"

namespace flappy::identify {

using Json = nlohmann::ordered_json;

/// A subcommand. `run` is called when its options are parsed; it prints, writes its files, and returns the output for --json.
struct Command {
  io::Command app;
  std::function<Json()> run;
  bool shown = false;  ///< whether flappy-report can show the output
};

Command add_forces(const io::Command& program);
Command add_simulate_forces(const io::Command& program);
Command add_calibrate(io::Program& owner);
Command add_compare_map(const io::Command& program);
Command add_kinematics(const io::Command& program);
Command add_transitions(const io::Command& program);
Command add_gait(const io::Command& program);

}  // namespace flappy::identify
