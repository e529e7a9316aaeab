// The part of policies that needs LibTorch. It is a plugin, because LibTorch takes half a second to start.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "policy/policy.hpp"
#include "policy/policy_network.hpp"

namespace flappy::policy {

/// load_policy() for TorchScript files. Throws io::InputError in a build without LibTorch.
std::unique_ptr<const Policy> load_torch_script(const std::filesystem::path& path, int observations, int actions);

/// The bytes of a TorchScript file whose forward(float[n][inputs]) gives float[n][outputs], zeros for an observation
/// with a NaN; its attribute `contract` holds the given text. Equal arguments give equal bytes. Throws
/// std::invalid_argument without LibTorch.
std::string torch_script(const PolicyNetwork& network, const std::string& contract);

/// The functions of the plugin: load_torch_script() and torch_script().
struct TorchFunctions {
  std::unique_ptr<const Policy> (*load)(const std::filesystem::path& path, int observations, int actions);
  std::string (*write)(const PolicyNetwork& network, const std::string& contract);
};
extern "C" const TorchFunctions flappy_torch_functions;  ///< the only symbol that the plugin exports

}  // namespace flappy::policy
