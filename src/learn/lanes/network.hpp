// Perceptrons, forward and backward, for kChunk samples at once. Values are [neuron][sample]. A layer's weights are
// [1 + inputs][padded outputs]; their first row, the bias, meets a row of ones. Padding is 0, without gradient.
#pragma once

#include "learn/lanes/matrix.hpp"
#include "learn/replay_buffer.hpp"
#include "policy/actor.hpp"

namespace flappy::learn {

FLAPPY_INLINE constexpr int padded(int width) { return (width + 15) / 16 * 16; }

/// Widths and activations of a network, and offsets of its weights and values.
struct NetworkShape {
  int layers = 0;
  int widths[policy::kMaxLayers + 1]{};  // number of inputs, then number of outputs of each layer
  policy::Activation hidden = policy::Activation::relu;
  bool bounded = false;                              // activation of the last layer: tanh, else none
  std::ptrdiff_t weights[policy::kMaxLayers + 1]{};  // offset of each layer's weights; then their number
  std::ptrdiff_t values[policy::kMaxLayers + 1]{};   // offset of each layer's inputs, with ones; then of the outputs

  NetworkShape() = default;
  NetworkShape(int depth, const int* width, policy::Activation activation, bool is_bounded)
      : layers(depth), hidden(activation), bounded(is_bounded) {
    for (int l = 0; l <= depth; ++l) {
      widths[l] = width[l];
      if (l == depth) break;
      weights[l + 1] = weights[l] + std::ptrdiff_t{1 + width[l]} * padded(width[l + 1]);
      values[l + 1] = values[l] + std::ptrdiff_t{1 + width[l]} * std::ptrdiff_t{kChunk};
    }
  }
  FLAPPY_INLINE std::ptrdiff_t weight_count() const { return weights[layers]; }
  FLAPPY_INLINE std::ptrdiff_t value_count() const {
    return values[layers] + std::ptrdiff_t{1 + widths[layers]} * std::ptrdiff_t{kChunk};
  }
  FLAPPY_INLINE int widest() const {
    int w = 0;
    for (int l = 0; l <= layers; ++l) w = widths[l] > w ? widths[l] : w;
    return padded(w);
  }
};

inline namespace FLAPPY_ISA {

inline constexpr std::ptrdiff_t kRow = kChunk;

template <class T>
using L = Lanes<T, kWidth<T>>;

/// Calls op(offset) for each register of lanes in `count` rows.
template <class T, class Op>
FLAPPY_INLINE void for_rows(int count, const Op& op) {
  for (std::ptrdiff_t i = 0; i < count * kRow; i += kWidth<T>) op(i);
}

/// The input rows of layer `l`, without the row of ones; for l == net.layers, the output rows of the network.
template <class T>
FLAPPY_INLINE T* rows_of(const NetworkShape& net, T* values, int l) {
  return values + net.values[l] + kRow;
}

/// Writes the rows of ones. No pass changes them, so this is needed only once.
template <class T>
FLAPPY_INLINE void put_ones(const NetworkShape& net, T* values) {
  for (int l = 0; l < net.layers; ++l)
    for (std::ptrdiff_t i = 0; i < kRow; ++i) values[net.values[l] + i] = 1;
}

template <class T>
FLAPPY_INLINE void activate_rows(policy::Activation kind, int rows, T* at) {
  if (kind == policy::Activation::relu)
    for_rows<T>(rows, [&](std::ptrdiff_t i) { max(L<T>::load(at + i), L<T>(0)).store(at + i); });
  else for_rows<T>(rows, [&](std::ptrdiff_t i) { tanh(L<T>::load(at + i)).store(at + i); });
}

/// Converts, in place, the gradient of the loss by an activation's outputs `out` to that by its inputs.
template <class T>
FLAPPY_INLINE void backpropagate(policy::Activation kind, int rows, const T* out, T* gradient) {
  if (kind == policy::Activation::relu)
    for_rows<T>(rows, [&](std::ptrdiff_t i) {
      where(L<T>::load(out + i) > L<T>(0), L<T>::load(gradient + i), L<T>(0)).store(gradient + i);
    });
  else
    for_rows<T>(rows, [&](std::ptrdiff_t i) {
      const L<T> y = L<T>::load(out + i);
      L<T>(L<T>::load(gradient + i) * L<T>(L<T>(1) - y * y)).store(gradient + i);
    });
}

/// Forward pass: computes all rows of `values` from the inputs of the first layer.
template <class T>
void forward(const NetworkShape& net, const T* weights, T* values) {
  for (int l = 0; l < net.layers; ++l) {
    const int out = net.widths[l + 1];
    T* to = rows_of(net, values, l + 1);
    multiply<T>(out, kRow, 1 + net.widths[l], {weights + net.weights[l], 1, padded(out)}, values + net.values[l], kRow,
                to, kRow);
    if (l + 1 < net.layers) activate_rows(net.hidden, out, to);
    else if (net.bounded) activate_rows(policy::Activation::tanh, out, to);
  }
}

/// Work memory of the backward pass: the loss's gradients by two layers' outputs, [widest][kChunk], and one transposed.
template <class T>
struct ActivationGradients {
  T *now, *next, *transposed;
};

/// Backward pass, summed over samples. s.now holds the gradient by the outputs, at the end by inputs `first` to `first`
/// + `inputs` - 1. That by the weights is written to `gradient`, or added if `accumulate`; null: not computed.
template <class T>
void backward(const NetworkShape& net, const T* weights, const T* values, ActivationGradients<T>& s, T* gradient,
              bool accumulate, int first, int inputs) {
  if (net.bounded)
    backpropagate(policy::Activation::tanh, net.widths[net.layers], values + net.values[net.layers] + kRow, s.now);
  for (int l = net.layers - 1; l >= 0; --l) {
    const int in = net.widths[l], out = net.widths[l + 1], wide = padded(out);
    if (gradient != nullptr) {
      for (std::ptrdiff_t i = out * kRow; i < wide * kRow; ++i) s.now[i] = 0;
      transpose(wide, kRow, s.now, kRow, s.transposed, wide);
      const Strided<T> a{values + net.values[l], kRow, 1};
      T* to = gradient + net.weights[l];
      if (accumulate) multiply<T, true>(1 + in, wide, kRow, a, s.transposed, wide, to, wide);
      else multiply<T>(1 + in, wide, kRow, a, s.transposed, wide, to, wide);
    }
    const int from = l > 0 ? 0 : first, count = l > 0 ? in : inputs;
    if (count == 0) continue;
    multiply<T>(count, kRow, out, {weights + net.weights[l] + std::ptrdiff_t{1 + from} * wide, wide, 1}, s.now, kRow,
                s.next, kRow);
    if (l > 0) backpropagate(net.hidden, count, values + net.values[l] + kRow, s.next);
    T* const spare = s.now;
    s.now = s.next, s.next = spare;
  }
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::learn
