// Figures of benchmarks, one JSON line each, in a file that grows over commits.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace flappy::bench {

/// Appends a line for each number of `results`: figure (`command` and its place in `results`, with points), value,
/// machine, processors, instruction_set, commit, date. Throws io::InputError where the file cannot be written.
void append_figures(const std::filesystem::path& file, const std::string& command,
                    const nlohmann::ordered_json& results);

}  // namespace flappy::bench
