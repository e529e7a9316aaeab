// The part of policies that needs LibTorch: a plugin, as LibTorch takes half a second to start, for whoever needs it alone.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "policy/policy.hpp"
#include "policy/policy_network.hpp"

namespace flappy::policy {

/// As load_policy(); io::InputError in a build without LibTorch.
std::unique_ptr<const Policy> load_torch_script(const std::filesystem::path& path, int observations, int actions);

/// The bytes of a TorchScript file: forward(float[n][inputs]) is float[n][outputs], where a row with a NaN in it gives zeros; its
/// attribute `contract` is a text. The same bytes for the same arguments. std::invalid_argument in a build without LibTorch.
std::string torch_script(const PolicyNetwork& network, const std::string& contract);

/// What the plugin does: the two functions above.
struct TorchFunctions {
  std::unique_ptr<const Policy> (*load)(const std::filesystem::path& path, int observations, int actions);
  std::string (*write)(const PolicyNetwork& network, const std::string& contract);
};
extern "C" const TorchFunctions flappy_torch_functions;  ///< all that the plugin exports

}  // namespace flappy::policy
