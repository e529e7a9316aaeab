#include "deploy/header/quantise.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "deploy/header/policy_vectors.hpp"
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

float lane_logistic(float x) { return std::fma(lane_tanh(x * 0.5F), 0.5F, 0.5F); }

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
  const auto inputs = static_cast<std::size_t>(n.inputs()), seen = static_cast<std::size_t>(n.observations());
  const std::size_t rows = observation.size() / inputs;
  if (rows == 0) throw std::invalid_argument("nothing to fit scales to");
  if (n.layer_norm || n.linear || (n.hidden != policy::Activation::relu && n.hidden != policy::Activation::tanh))
    throw std::invalid_argument("a network that whole numbers do not hold");
  const bool relu = n.hidden == policy::Activation::relu;
  QuantisedNetwork q{n.widths, relu, n.recurrent, n.mean, n.scale, {}, {}, {}, n.middle, n.half};
  // activations as real numbers, [row][input]; `largest`: largest magnitude of each input
  std::vector<float> values, largest(seen, 0);
  for (std::size_t k = 0; k < rows * inputs; ++k) {
    const std::size_t i = k % inputs;
    if (i >= seen) continue;
    values.push_back(std::clamp((observation[k] - n.mean[i]) * n.scale[i], -n.clip, n.clip));
    largest[i] = std::max(largest[i], std::abs(values.back()));
  }
  for (std::size_t i = 0; i < seen; ++i) {
    if (!(largest[i] > 0)) largest[i] = 1;
    q.scale[i] = n.scale[i] * kLargest / largest[i];
  }
  std::vector<double> step(seen);  // resolution of each input of the layer
  for (std::size_t i = 0; i < seen; ++i) step[i] = largest[i] / kLargest;

  const float* weights = n.weights.data();
  // `next_step`: unit of what the layer makes of its sums
  const auto add = [&](const std::vector<double>& input_step, std::size_t out, double next_step) {
    const std::size_t in = input_step.size();
    for (std::size_t o = 0; o < out; ++o) {
      const float* w = weights + o * (in + 1);
      double most = 0;
      for (std::size_t i = 0; i < in; ++i) most = std::max(most, std::abs(w[1 + i] * input_step[i]));
      // unit of the sum: the weights fill 8 bits, and the bias stays within what single precision represents
      const double least = std::max(most / static_cast<double>(kLargest), std::abs(w[0]) * 0x1p-22);
      const double unit = least > 0 ? least : 1;
      for (std::size_t i = 0; i < in; ++i)
        q.weights.push_back(rounded(static_cast<float>(w[1 + i] * input_step[i] / unit)));
      q.bias.push_back(static_cast<std::int32_t>(std::nearbyint(w[0] / unit)));
      q.multiplier.push_back(static_cast<float>(unit / next_step));
    }
    weights += out * (in + 1);
  };
  constexpr double kOfTanh = 1 / static_cast<double>(kLargest);
  if (n.recurrent) {
    const auto units = static_cast<std::size_t>(n.memory());
    add(step, 3 * units, 1);
    step.assign(units, kOfTanh);
    add(step, 3 * units, 1);
    const std::vector<float> made = evaluate(n, observation);
    values.clear();
    for (std::size_t k = 0; k < made.size(); ++k)
      if (k % (made.size() / rows) >= static_cast<std::size_t>(n.actions())) values.push_back(made[k]);
  }
  for (std::size_t layer = n.recurrent ? 1 : 0; layer + 1 < n.widths.size(); ++layer) {
    const auto in = static_cast<std::size_t>(n.widths[layer]), out = static_cast<std::size_t>(n.widths[layer + 1]);
    const bool last = layer + 2 == n.widths.size();
    std::vector<float> next(rows * out);
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t o = 0; o < out; ++o) {
        float sum = weights[o * (in + 1)];
        for (std::size_t i = 0; i < in; ++i) sum += weights[o * (in + 1) + 1 + i] * values[row * in + i];
        next[row * out + o] = last ? sum : relu ? std::max(sum, 0.0F) : lane_tanh(sum);
      }
    const double next_step = last ? 1 : relu ? best_step(next) : kOfTanh;
    add(step, out, last || !relu ? 1 : next_step);
    values = std::move(next);
    step.assign(out, next_step);
  }
  return q;
}

std::vector<float> evaluate(const QuantisedNetwork& n, const std::vector<float>& observation) {
  const auto inputs = static_cast<std::size_t>(n.inputs()), seen = static_cast<std::size_t>(n.observations());
  const auto units = static_cast<std::size_t>(n.memory());
  std::vector<float> action;
  for (std::size_t row = 0; row < observation.size(); row += inputs) {
    std::vector<std::int8_t> values;
    for (std::size_t i = 0; i < seen; ++i) {
      const float shifted = observation[row + i] - n.mean[i];
      values.push_back(rounded(shifted * n.scale[i]));
    }
    const std::int8_t* weight = n.weights.data();
    std::size_t output = 0;
    const auto next_sum = [&] {
      std::int32_t sum = n.bias[output];
      for (const std::int8_t x : values) sum += *weight++ * x;
      return static_cast<float>(sum) * n.multiplier[output++];
    };
    std::vector<float> memory(observation.begin() + static_cast<std::ptrdiff_t>(row + seen),
                              observation.begin() + static_cast<std::ptrdiff_t>(row + inputs));
    const auto round_memory = [&] {
      values.clear();
      for (const float h : memory) values.push_back(rounded(kLargest * h));
    };
    if (n.recurrent) {
      std::vector<float> sums[2];
      for (std::vector<float>& of : sums) {
        for (std::size_t k = 0; k < 3 * units; ++k) of.push_back(next_sum());
        round_memory();
      }
      for (std::size_t k = 0; k < units; ++k) {
        const float reset = lane_logistic(sums[0][k] + sums[1][k]);
        const float update = lane_logistic(sums[0][units + k] + sums[1][units + k]);
        const float fresh = lane_tanh(std::fma(reset, sums[1][2 * units + k], sums[0][2 * units + k]));
        const float less = memory[k] - fresh;
        memory[k] = std::fma(update, less, fresh);
      }
      round_memory();
    }
    for (std::size_t layer = n.recurrent ? 1 : 0; layer + 1 < n.widths.size(); ++layer) {
      const bool last = layer + 2 == n.widths.size();
      std::vector<std::int8_t> next;
      for (int o = 0; o < n.widths[layer + 1]; ++o) {
        const float y = next_sum();
        const auto k = static_cast<std::size_t>(o);
        if (last) action.push_back(std::fma(n.half[k], lane_tanh(y), n.middle[k]));
        else next.push_back(rounded(n.relu ? model::max(y, 0.0F) : kLargest * lane_tanh(y)));
      }
      values = std::move(next);
    }
    action.insert(action.end(), memory.begin(), memory.end());
  }
  return action;
}

}  // namespace flappy::deploy
