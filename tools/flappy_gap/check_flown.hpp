// Whether robots flew what flappy-export wrote, or would write of a run: flights are replayed through it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace flappy::gap {

/// `exported`: what flappy-export wrote, or a finished run's folder. Prints a line for each flight. "as_exported" in the
/// result: whether all did.
nlohmann::ordered_json check_flown(const std::string& exported, const std::vector<std::string>& folders);

}  // namespace flappy::gap
