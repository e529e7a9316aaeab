// Policies of designs, by flappy-train and flappy-eval of the same installation.
#pragma once

#include <filesystem>

#include "design/study.hpp"

namespace flappy {

/// Trains a policy for the design whose files are in `folder`, to `folder`/policy, and evaluates it; a run that was
/// stopped goes on, one that is finished stays. Throws io::InputError with what flappy-train said where it refuses.
design::Policy trained(const std::filesystem::path& folder, const std::filesystem::path& config);

}  // namespace flappy
