// Evaluation of a trained actor (multilayer perceptron, which may begin with a GRU) for many flappers at once: rows of observations to rows of
// actions. Training, evaluation, diagnosis and flights all use it.
#pragma once

#include <algorithm>

#include "model/math.hpp"
#include "policy/activation.hpp"

namespace flappy::policy {

inline constexpr int kMaxActions = 4;  // four wing-beat inputs; or two voltages
/// Limited by the 2 kB of a flapper; all parts together would have 44 elements.
inline constexpr int kMaxObservation = 40;
inline constexpr int kMaxHistory = 8;  // observations that an actor sees at once

inline constexpr int kMaxLayers = 32, kMaxWidth = 2048;
inline constexpr int kMaxMemory = 64;  // units of a GRU

/// Weights of a layer: for each output its bias, then one weight for each input. With layer norm (Ba et al. 2016, arXiv
/// 1607.06450), a hidden layer's weights are followed by a gain for each output, then a shift for each output. Hidden
/// layers share one activation. The last layer's is tanh, or, if `linear`, a clamp to [-1, 1].
/// If `recurrent`, the first layer is a GRU (Cho et al. 2014, arXiv 1406.1078; the variant of torch's GRU) and has two
/// blocks of weights in its place: three outputs of each unit from the inputs, then three of each unit from the memory.
/// In each block come all reset gates, all update gates, all new values. The layer's output is its memory.
template <class T>
struct ActorView {
  int layers = 0;                // 0: no actor
  int widths[kMaxLayers + 1]{};  // number of inputs, then number of outputs of each layer
  Activation hidden = Activation::relu;
  bool layer_norm = false;  // layer norm before each hidden activation
  bool linear = false;      // the last layer is clamped, without tanh
  bool recurrent = false;
  const T* weights = nullptr;  // weights of all layers in order
  const T* mean = nullptr;     // [input]
  const T* scale = nullptr;    // [input]: input = clamp((observation - mean) * scale, +-clip)
  T clip = 0;

  int memory() const { return recurrent ? widths[1] : 0; }
};

/// View of an Actor or a PolicyNetwork, whose weights, mean and scale are stored elsewhere in type T.
template <class T, class Shape>
ActorView<T> view_of(const Shape& shape, const T* weights, const T* mean, const T* scale) {
  ActorView<T> view;
  view.layers = static_cast<int>(shape.widths.size()) - 1;
  std::ranges::copy(shape.widths, view.widths);
  view.hidden = shape.hidden;
  view.layer_norm = shape.layer_norm;
  view.linear = shape.linear;
  view.recurrent = shape.recurrent;
  view.weights = weights, view.mean = mean, view.scale = scale;
  view.clip = static_cast<T>(shape.clip);
  return view;
}

inline namespace FLAPPY_ISA {

using namespace model;

/// silu and elu are computed from t = tanh(x / 2): 1 / (1 + exp(-x)) = (1 + t) / 2, exp(x) - 1 = 2 t / (1 - t).
template <class L>
FLAPPY_INLINE L silu(const L& x) {
  const L half = x * L(0.5);
  return half * tanh(half) + half;
}
template <class L>
FLAPPY_INLINE L elu(const L& x) {
  const L t = tanh(L(min(x, L(0)) * L(0.5)));
  return where(x > L(0), x, L(L(t + t) / L(L(1) - t)));
}

template <class L>
FLAPPY_INLINE void activate(Activation kind, int count, L* x) {
  switch (kind) {
    case Activation::relu:
      for (int i = 0; i < count; ++i) x[i] = max(x[i], L(0));
      return;
    case Activation::tanh:
      for (int i = 0; i < count; ++i) x[i] = tanh(x[i]);
      return;
    case Activation::elu:
      for (int i = 0; i < count; ++i) x[i] = elu(x[i]);
      return;
    case Activation::silu:
      for (int i = 0; i < count; ++i) x[i] = silu(x[i]);
      return;
  }
}

template <class L>
FLAPPY_INLINE void normalise(const Element<L>* gains, int count, L* x) {
  const L share = L(1) / L(static_cast<Element<L>>(count));
  L sum(0), squares(0);
  for (int i = 0; i < count; ++i) sum += x[i];
  const L mean = sum * share;
  for (int i = 0; i < count; ++i) {
    x[i] -= mean;
    squares += x[i] * x[i];
  }
  const L scale = L(1) / sqrt(L(squares * share + L(static_cast<Element<L>>(kLayerNormEpsilon))));
  for (int i = 0; i < count; ++i) x[i] = L(x[i] * scale) * L(gains[i]) + L(gains[count + i]);
}

/// Sums of kOutputs neurons at once, so that each input is loaded once for all of them.
template <int kOutputs, class L>
FLAPPY_INLINE void neurons(const Element<L>* weights, int inputs, const L* in, L* out) {
  const std::ptrdiff_t row = inputs + 1;
  L sum[kOutputs];
  for (int o = 0; o < kOutputs; ++o) sum[o] = L(weights[o * row]);
  for (int i = 0; i < inputs; ++i)
    for (int o = 0; o < kOutputs; ++o) sum[o] += L(weights[o * row + 1 + i]) * in[i];
  for (int o = 0; o < kOutputs; ++o) out[o] = sum[o];
}

/// Computes the sums of all neurons of a layer. Returns the weights that follow.
template <class L>
FLAPPY_INLINE const Element<L>* layer_sums(const Element<L>* weights, int inputs, const L* in, int outputs, L* out) {
  const std::ptrdiff_t row = inputs + 1;
  int o = 0;
  for (; o + 8 <= outputs; o += 8, weights += 8 * row) neurons<8>(weights, inputs, in, out + o);
  for (; o < outputs; ++o, weights += row) neurons<1>(weights, inputs, in, out + o);
  return weights;
}

/// 1 / (1 + exp(-x))
template <class L>
FLAPPY_INLINE L logistic(const L& x) {
  return tanh(L(x * L(0.5))) * L(0.5) + L(0.5);
}

/// A GRU: r = logistic(x_r + h_r), z = logistic(x_z + h_z), n = tanh(x_n + r h_n), h' = n + z (h - n), where x and h are
/// sums over the inputs and over the memory h. Returns the weights that follow.
template <class L>
FLAPPY_INLINE const Element<L>* remember(const Element<L>* weights, int inputs, const L* in, int units, L* memory) {
  L seen[3 * kMaxMemory], kept[3 * kMaxMemory];
  weights = layer_sums(weights, inputs, in, 3 * units, seen);
  weights = layer_sums(weights, units, memory, 3 * units, kept);
  for (int k = 0; k < units; ++k) {
    const L reset = logistic(L(seen[k] + kept[k])), update = logistic(L(seen[units + k] + kept[units + k]));
    const L fresh = tanh(L(reset * kept[2 * units + k] + seen[2 * units + k]));
    memory[k] = update * L(memory[k] - fresh) + fresh;
  }
  return weights;
}

/// Evaluates the actor. `observation`: widths[0] rows; `action`: one row for each output of the last layer; `memory`:
/// memory() rows, which it changes.
template <class L>
FLAPPY_INLINE void evaluate(const ActorView<Element<L>>& actor, const L* observation, L* action, L* memory = nullptr) {
  L values[2][kMaxWidth];
  const L clip(actor.clip);
  for (int i = 0; i < actor.widths[0]; ++i)
    values[0][i] = clamp(L((observation[i] - L(actor.mean[i])) * L(actor.scale[i])), L(-clip), clip);
  const Element<L>* weights = actor.weights;
  int layer = 0;
  if (actor.recurrent) {
    weights = remember(weights, actor.widths[0], values[0], actor.widths[1], memory);
    for (int k = 0; k < actor.widths[1]; ++k) values[1][k] = memory[k];
    layer = 1;
  }
  for (; layer < actor.layers; ++layer) {
    const int outputs = actor.widths[layer + 1];
    L* out = values[(layer + 1) % 2];
    weights = layer_sums(weights, actor.widths[layer], values[layer % 2], outputs, out);
    const bool last = layer + 1 == actor.layers;
    if (actor.layer_norm && !last) {
      normalise(weights, outputs, out);
      weights += 2 * outputs;
    }
    if (last && actor.linear)
      for (int k = 0; k < outputs; ++k)
        out[k] = clamp(out[k], L(-1), L(1));  // NOLINT(clang-analyzer-core.CallAndMessage): neurons() has written it
    else activate(last ? Activation::tanh : actor.hidden, outputs, out);
  }
  for (int o = 0; o < actor.widths[actor.layers]; ++o) action[o] = values[actor.layers % 2][o];
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::policy
