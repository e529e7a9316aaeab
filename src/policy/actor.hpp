// A trained actor (multilayer perceptron) for many flappers at once: training, evaluation, diagnosis and flights all
// evaluate it here. Observation rows in, action rows out.
#pragma once

#include "model/math.hpp"

namespace flappy::policy {

inline constexpr int kActions = 4;
inline constexpr int kMaxObservation = 40;  // all parts together

enum class Activation { relu, tanh };

inline constexpr int kMaxLayers = 6, kMaxWidth = 256;

/// Weights of each layer: for every output its bias, then one weight for each input. Hidden layers share one activation,
/// the last is tanh.
template <class T>
struct ActorView {
  int layers = 0;                // 0: no actor
  int widths[kMaxLayers + 1]{};  // inputs, then outputs of each layer
  Activation hidden = Activation::relu;
  const T* weights = nullptr;  // of all layers, one after the other
  const T* mean = nullptr;     // of each input
  const T* scale = nullptr;    // input = clamp((observation - mean) * scale, +-clip)
  T clip = 0;
};

inline namespace FLAPPY_ISA {

using namespace model;

template <class T>
FLAPPY_INLINE T activated(Activation kind, const T& x) {
  // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): no width is 0
  return kind == Activation::relu ? max(x, T(0)) : tanh(x);
}

/// kOutputs neurons at once, so that an input is fetched once for all of them.
template <int kOutputs, class L>
FLAPPY_INLINE void neurons(const Element<L>* weights, int inputs, const L* in, L* out) {
  const std::ptrdiff_t row = inputs + 1;
  L sum[kOutputs];
  for (int o = 0; o < kOutputs; ++o) sum[o] = L(weights[o * row]);
  for (int i = 0; i < inputs; ++i)
    for (int o = 0; o < kOutputs; ++o) sum[o] += L(weights[o * row + 1 + i]) * in[i];
  for (int o = 0; o < kOutputs; ++o) out[o] = sum[o];
}

/// `observation`: widths[0] rows; `action`: as many as the last layer has outputs.
template <class L>
FLAPPY_INLINE void evaluate(const ActorView<Element<L>>& actor, const L* observation, L* action) {
  L values[2][kMaxWidth];
  const L clip(actor.clip);
  for (int i = 0; i < actor.widths[0]; ++i)
    values[0][i] = clamp(L((observation[i] - L(actor.mean[i])) * L(actor.scale[i])), L(-clip), clip);
  const Element<L>* weights = actor.weights;
  for (int layer = 0; layer < actor.layers; ++layer) {
    const int inputs = actor.widths[layer], outputs = actor.widths[layer + 1];
    const L* in = values[layer % 2];
    L* out = values[(layer + 1) % 2];
    const std::ptrdiff_t row = inputs + 1;
    int o = 0;
    for (; o + 8 <= outputs; o += 8, weights += 8 * row) neurons<8>(weights, inputs, in, out + o);
    for (; o < outputs; ++o, weights += row) neurons<1>(weights, inputs, in, out + o);
    const bool last = layer + 1 == actor.layers;
    for (o = 0; o < outputs; ++o) out[o] = activated(last ? Activation::tanh : actor.hidden, out[o]);
  }
  for (int o = 0; o < actor.widths[actor.layers]; ++o) action[o] = values[actor.layers % 2][o];
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::policy
