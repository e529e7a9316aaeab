// flappy-identify transitions: the open-loop test.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>

namespace flappy::identify {

/// Adds the subcommand; the job that it returns runs it.
std::function<nlohmann::ordered_json()> add_transitions(CLI::App& app);

}  // namespace flappy::identify
