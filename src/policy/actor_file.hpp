// A trained actor on disk: JSON, so that any tool can read it. Weights of a layer: for every output its bias, then one
// weight for each input; with layer norm, after those of a hidden layer a gain for each output, then a shift for each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "policy/actor.hpp"

namespace flappy::policy {

struct Actor {
  std::string task;
  std::vector<std::string> observation, action;  ///< names of its inputs and outputs
  std::vector<int> widths;                       ///< inputs, then outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  ///< before each hidden activation
  bool linear = false;      ///< the last layer: its sums as they are, within [-1, 1], in place of their tanh
  std::vector<double> weights, mean, scale;
  double clip = 10;
};

/// io::InputError, with the file's name, for anything that is no actor.
Actor read_actor(const std::filesystem::path& path);
void write_actor(const std::filesystem::path& path, const Actor& actor);

/// Number of weights that `widths` asks for.
std::size_t weight_count(const std::vector<int>& widths, bool layer_norm = false);

}  // namespace flappy::policy
