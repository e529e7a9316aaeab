// The subcommands of flappy-identify, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>

namespace flappy::identify {

using Json = nlohmann::ordered_json;

/// A subcommand, and what it does once its options are parsed: prints, writes its files, returns what --json asks for.
struct Command {
  CLI::App* app;
  std::function<Json()> run;
};

Command add_forces(CLI::App& program);
Command add_simulate_forces(CLI::App& program);
Command add_calibrate(CLI::App& program);
Command add_compare_map(CLI::App& program);
Command add_kinematics(CLI::App& program);
Command add_transitions(CLI::App& program);

}  // namespace flappy::identify
