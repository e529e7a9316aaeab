// The part of policies that needs LibTorch.
#pragma once

#include "deploy/policy.hpp"

namespace flappy::deploy {

/// As load_policy(); io::InputError in a build without LibTorch.
std::unique_ptr<const Policy> load_torch_script(const std::filesystem::path& path, int observations, int actions);

}  // namespace flappy::deploy
