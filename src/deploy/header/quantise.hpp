// A policy in whole numbers: weights of 8 bits with a scale for each output (symmetric), activations of 8 bits with one scale
// for each layer, sums of 32 bits.
//
//   q0 = round(clamp((observation - mean) scale, +-127))            scale: what flights showed fills the range
//   sum = bias + W q         y = sum multiplier                     for each output of a layer
//   q = round(clamp(max(y, 0), 127))   or   round(127 tanh y)       hidden layers: relu, tanh
//   action = middle + half tanh y                                   the last
#pragma once

#include <cstdint>

#include "policy/policy_network.hpp"

namespace flappy::deploy {

struct QuantisedNetwork {
  std::vector<int> widths;
  bool relu = true;
  std::vector<float> mean, scale;
  std::vector<std::int8_t> weights;  ///< of each layer: for every output one for each input
  std::vector<std::int32_t> bias;    ///< of each layer's outputs
  std::vector<float> multiplier;     ///<   the same
  std::vector<float> middle, half;

  int inputs() const { return widths.front(); }
  int outputs() const { return widths.back(); }
};

/// Scales are fitted to `observation`, float[n][inputs]: inputs to the largest values seen, hidden activations to the least
/// mean square of their rounding and clipping.
QuantisedNetwork quantise(const policy::PolicyNetwork& network, const std::vector<float>& observation);

/// As the exported C computes it, to the bit.
std::vector<float> evaluate(const QuantisedNetwork& network, const std::vector<float>& observation);

}  // namespace flappy::deploy
