// A trained actor as numbers alone, in the order in which they are used. Plain C++17, for what includes LibTorch.
#pragma once

#include <string>
#include <vector>

#include "policy/activation.hpp"

namespace flappy::policy {

/// action = middle + half tanh(...(clamp((observation - mean) scale, +-clip)))
struct PolicyNetwork {
  std::vector<int> widths;  ///< inputs, then outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  ///< of the sums of hidden layers, before their activation
  bool linear = false;      ///< the last layer: its sums as they are, within [-1, 1], in place of their tanh
  float clip = 0;
  std::vector<float> mean, scale;  ///< of each input
  std::vector<float>
      weights;  ///< of each layer: for every output its bias, then one weight for each input; gains and shifts
  std::vector<float> middle, half;  ///< of each output, in its unit

  int inputs() const { return widths.front(); }
  int outputs() const { return widths.back(); }
};

/// Observations and what is to be done upon them, a row for each: float[rows][inputs], float[rows][outputs].
struct PolicyVectors {
  int inputs = 0, outputs = 0;
  std::vector<float> observation, action;

  std::size_t rows() const { return observation.size() / static_cast<std::size_t>(inputs); }
};

}  // namespace flappy::policy
