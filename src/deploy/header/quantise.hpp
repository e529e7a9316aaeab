// A policy in integers: weights of 8 bits, scaled per output (symmetric), activations of 8 bits, scaled per layer,
// 32-bit sums.
//
//   q0 = round(clamp((observation - mean) scale, +-127))            scale: the values seen in flight fill the range
//   sum = bias + W q         y = sum multiplier                     for each output of a layer
//   q = round(clamp(max(y, 0), 127))   or   round(127 tanh y)       hidden layers: relu, tanh
//   action = middle + half tanh y                                   last layer
//
// The gates of a GRU are of y, as they are; its memory enters sums as round(127 h).
#pragma once

#include <cstdint>

#include "policy/policy_network.hpp"

namespace flappy::deploy {

struct QuantisedNetwork {
  std::vector<int> widths;
  bool relu = true, recurrent = false;
  std::vector<float> mean, scale;
  /// [layer][output][input]; a recurrent first layer is two: three outputs of each unit from the observation, then from the
  /// memory
  std::vector<std::int8_t> weights;
  std::vector<std::int32_t> bias;  ///< [layer][output]
  std::vector<float> multiplier;   ///< [layer][output]
  std::vector<float> middle, half;

  int observations() const { return widths.front(); }
  int actions() const { return widths.back(); }
  int memory() const { return recurrent ? widths[1] : 0; }
  int inputs() const { return observations() + memory(); }
  int outputs() const { return actions() + memory(); }
};

/// Scales fit `observation`, float[n][inputs]: inputs the largest values seen, activations the least mean square error.
/// Throws std::invalid_argument for layer norm, a linear output, or activations other than relu and tanh.
QuantisedNetwork quantise(const policy::PolicyNetwork& network, const std::vector<float>& observation);

/// Evaluates the network exactly as the exported C does, to the bit.
std::vector<float> evaluate(const QuantisedNetwork& network, const std::vector<float>& observation);

}  // namespace flappy::deploy
