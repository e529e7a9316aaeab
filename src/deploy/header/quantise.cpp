#include "deploy/header/quantise.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/math.hpp"
#include "sim/lanes.hpp"

namespace flappy::deploy {
namespace {

constexpr float kLargest = 127;

std::int8_t rounded(float x) {
  const float limited = model::clamp(x, -kLargest, kLargest);
  return static_cast<std::int8_t>(model::nearest(limited));
}

/// The simulator's tanh, in which a product and a sum are fused.
float lane_tanh(float x) { return model::tanh(model::Lanes<float, 1>::load(&x)).raw[0]; }

/// Error of rounding and clipping the values to 8 bits with this step, as a mean square.
double loss(const std::vector<float>& values, double step) {
  double sum = 0;
  for (const float v : values) {
    const double kept = step * std::clamp(std::nearbyint(v / step), -127.0, 127.0);
    sum += (v - kept) * (v - kept);
  }
  return sum;
}

/// The step with the smallest loss, from the step that clips nothing down to a third of it.
double best_step(const std::vector<float>& values) {
  float most = 0;
  for (const float v : values) most = std::max(most, std::abs(v));
  const double widest = most > 0 ? most / static_cast<double>(kLargest) : 1.0 / static_cast<double>(kLargest);
  double best = widest;
  for (int i = 1; i < 60; ++i)
    if (const double step = widest * model::exp(-model::log(3.0) * i / 60); loss(values, step) < loss(values, best))
      best = step;
  return best;
}

}  // namespace

QuantisedNetwork quantise(const policy::PolicyNetwork& n, const std::vector<float>& observation) {
  const auto inputs = static_cast<std::size_t>(n.inputs());
  const std::size_t rows = observation.size() / inputs;
  if (rows == 0) throw std::invalid_argument("nothing to fit scales to");
  if (n.layer_norm || n.linear || (n.hidden != policy::Activation::relu && n.hidden != policy::Activation::tanh))
    throw std::invalid_argument("a network that whole numbers do not hold");
  const bool relu = n.hidden == policy::Activation::relu;
  QuantisedNetwork q{n.widths, relu, n.mean, n.scale, {}, {}, {}, n.middle, n.half};
  // activations as real numbers; `largest`: largest magnitude of each input
  std::vector<float> values(rows * inputs), largest(inputs, 0);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::size_t i = k % inputs;
    values[k] = std::clamp((observation[k] - n.mean[i]) * n.scale[i], -n.clip, n.clip);
    largest[i] = std::max(largest[i], std::abs(values[k]));
  }
  for (std::size_t i = 0; i < inputs; ++i) {
    if (!(largest[i] > 0)) largest[i] = 1;
    q.scale[i] = n.scale[i] * kLargest / largest[i];
  }
  std::vector<double> step(inputs);  // resolution of each input of the layer
  for (std::size_t i = 0; i < inputs; ++i) step[i] = largest[i] / kLargest;

  const float* weights = n.weights.data();
  for (std::size_t layer = 0; layer + 1 < n.widths.size(); ++layer) {
    const auto in = static_cast<std::size_t>(n.widths[layer]), out = static_cast<std::size_t>(n.widths[layer + 1]);
    const bool last = layer + 2 == n.widths.size();
    std::vector<float> next(rows * out);
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t o = 0; o < out; ++o) {
        float sum = weights[o * (in + 1)];
        for (std::size_t i = 0; i < in; ++i) sum += weights[o * (in + 1) + 1 + i] * values[row * in + i];
        next[row * out + o] = last ? sum : relu ? std::max(sum, 0.0F) : lane_tanh(sum);
      }
    const double next_step = last ? 1 : relu ? best_step(next) : 1 / static_cast<double>(kLargest);
    for (std::size_t o = 0; o < out; ++o) {
      const float* w = weights + o * (in + 1);
      double most = 0;
      for (std::size_t i = 0; i < in; ++i) most = std::max(most, std::abs(w[1 + i] * step[i]));
      // unit of the sum: the weights fill 8 bits, and the bias stays within what single precision represents
      const double least = std::max(most / static_cast<double>(kLargest), std::abs(w[0]) * 0x1p-22);
      const double unit = least > 0 ? least : 1;
      for (std::size_t i = 0; i < in; ++i) q.weights.push_back(rounded(static_cast<float>(w[1 + i] * step[i] / unit)));
      q.bias.push_back(static_cast<std::int32_t>(std::nearbyint(w[0] / unit)));
      q.multiplier.push_back(static_cast<float>(last || !relu ? unit : unit / next_step));
    }
    weights += out * (in + 1);
    values = std::move(next);
    step.assign(out, next_step);
  }
  return q;
}

std::vector<float> evaluate(const QuantisedNetwork& n, const std::vector<float>& observation) {
  const auto inputs = static_cast<std::size_t>(n.inputs());
  std::vector<float> action;
  for (std::size_t row = 0; row < observation.size(); row += inputs) {
    std::vector<std::int8_t> values;
    for (std::size_t i = 0; i < inputs; ++i) {
      const float shifted = observation[row + i] - n.mean[i];
      values.push_back(rounded(shifted * n.scale[i]));
    }
    const std::int8_t* weight = n.weights.data();
    std::size_t output = 0;
    for (std::size_t layer = 0; layer + 1 < n.widths.size(); ++layer) {
      const bool last = layer + 2 == n.widths.size();
      std::vector<std::int8_t> next;
      for (int o = 0; o < n.widths[layer + 1]; ++o, ++output) {
        std::int32_t sum = n.bias[output];
        for (const std::int8_t x : values) sum += *weight++ * x;
        const float y = static_cast<float>(sum) * n.multiplier[output];
        const auto k = static_cast<std::size_t>(o);
        if (last) action.push_back(std::fma(n.half[k], lane_tanh(y), n.middle[k]));
        else next.push_back(rounded(n.relu ? model::max(y, 0.0F) : kLargest * lane_tanh(y)));
      }
      values = std::move(next);
    }
  }
  return action;
}

}  // namespace flappy::deploy
