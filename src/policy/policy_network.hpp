// A trained actor as plain numbers, in the order in which they are used. In C++17, for files that include LibTorch.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "policy/activation.hpp"

namespace flappy::policy {

/// The blocks of a network's weights in their order, each as its inputs and outputs: one for each layer, but two for a
/// GRU, whose units have three outputs of the observation and three of the memory.
inline std::vector<std::pair<int, int>> weight_blocks(const std::vector<int>& widths, bool recurrent) {
  std::vector<std::pair<int, int>> blocks;
  if (recurrent) blocks = {{widths[0], 3 * widths[1]}, {widths[1], 3 * widths[1]}};
  for (std::size_t layer = recurrent ? 1 : 0; layer + 1 < widths.size(); ++layer)
    blocks.emplace_back(widths[layer], widths[layer + 1]);
  return blocks;
}

/// action = middle + half tanh(...(clamp((observation - mean) scale, +-clip)))
/// A recurrent one is a function, too, whose inputs are the observation and the memory, and whose outputs are the action
/// and the next memory. At the start of a flight, the memory is 0.
struct PolicyNetwork {
  std::vector<int> widths;  ///< number of inputs, then number of outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  ///< layer norm before each hidden activation
  bool linear = false;      ///< the last layer is clamped to [-1, 1], without tanh
  bool recurrent = false;   ///< the first layer is a GRU
  float clip = 0;
  std::vector<float> mean, scale;   ///< [element of the observation]
  std::vector<float> weights;       ///< in the order of ActorView (actor.hpp)
  std::vector<float> middle, half;  ///< [element of the action]: middle and half width of its range, in its unit

  int observations() const { return widths.front(); }
  int actions() const { return widths.back(); }
  int memory() const { return recurrent ? widths[1] : 0; }
  int inputs() const { return observations() + memory(); }
  int outputs() const { return actions() + memory(); }
  /// [output]: half width of the range; that of a memory is -1 to 1.
  std::vector<float> output_half() const {
    std::vector<float> list = half;
    list.resize(static_cast<std::size_t>(outputs()), 1);
    return list;
  }
};

/// Test vectors: observations, float[rows][inputs], and the actions they should give, float[rows][outputs]; of a
/// recurrent policy each with the memory behind it.
struct PolicyVectors {
  int inputs = 0, outputs = 0;
  std::vector<float> observation, action;

  std::size_t rows() const { return observation.size() / static_cast<std::size_t>(inputs); }
};

}  // namespace flappy::policy
