// A trained actor as plain numbers, in the order in which they are used. In C++17, for files that include LibTorch.
#pragma once

#include <string>
#include <vector>

#include "policy/activation.hpp"

namespace flappy::policy {

/// action = middle + half tanh(...(clamp((observation - mean) scale, +-clip)))
struct PolicyNetwork {
  std::vector<int> widths;  ///< number of inputs, then number of outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  ///< layer norm before each hidden activation
  bool linear = false;      ///< the last layer is clamped to [-1, 1], without tanh
  float clip = 0;
  std::vector<float> mean, scale;   ///< [input]
  std::vector<float> weights;       ///< in the order of ActorView (actor.hpp)
  std::vector<float> middle, half;  ///< [output]: middle and half width of the range, in the unit of the output

  int inputs() const { return widths.front(); }
  int outputs() const { return widths.back(); }
};

/// Test vectors: observations, float[rows][inputs], and the actions they should give, float[rows][outputs].
struct PolicyVectors {
  int inputs = 0, outputs = 0;
  std::vector<float> observation, action;

  std::size_t rows() const { return observation.size() / static_cast<std::size_t>(inputs); }
};

}  // namespace flappy::policy
