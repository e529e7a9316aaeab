// File of a trained actor, in JSON so that any tool can read it. Order of the weights as in ActorView (actor.hpp).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "policy/actor.hpp"

namespace flappy::policy {

struct Actor {
  std::string task;
  std::vector<std::string> observation, action;  ///< names of inputs and outputs
  std::vector<int> widths;                       ///< number of inputs, then number of outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  ///< layer norm before each hidden activation
  bool linear = false;      ///< the last layer is clamped to [-1, 1], without tanh
  bool recurrent = false;   ///< the first layer is a GRU
  std::vector<double> weights, mean, scale;
  double clip = 10;
};

/// Throws io::InputError, with the file's name, if the file is not a valid actor.
Actor read_actor(const std::filesystem::path& path);
void write_actor(const std::filesystem::path& path, const Actor& actor);

/// Number of weights of a network with these widths; with layer norm, gains and shifts included. `recurrent`: the first
/// layer is a GRU.
std::size_t weight_count(const std::vector<int>& widths, bool layer_norm = false, bool recurrent = false);

}  // namespace flappy::policy
