// Flies a batch of flappers at one constant input.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace flappy::bench {

/// Flies the batch of `config`, prints a summary, and returns it.
nlohmann::ordered_json fly_batch(const std::filesystem::path& config, const std::vector<std::string>& overrides);

}  // namespace flappy::bench
