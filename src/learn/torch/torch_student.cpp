#include "learn/torch/torch_student.hpp"

#include <ATen/Parallel.h>
#include <torch/csrc/autograd/autograd.h>
#include <torch/csrc/autograd/generated/variable_factories.h>
#include <torch/types.h>

#include <cmath>

#include "learn/torch/torch_learner.hpp"
#include "policy/policy_network.hpp"

namespace flappy::learn {
namespace {

constexpr double kBeta1 = 0.9, kBeta2 = 0.999, kEpsilon = 1e-8;
constexpr double kLongestGradient = 1;  // through time, a few flights would otherwise decide a step

/// Its rows are outputs: each has the bias, then the weights, as in an actor's file.
using Rows = torch::Tensor;

torch::Tensor sums(const Rows& rows, const torch::Tensor& x) {
  return torch::addmm(rows.select(1, 0), x, rows.narrow(1, 1, rows.size(1) - 1).t());
}

class Student : public TorchStudent {
 public:
  explicit Student(const policy::Actor& actor) : actor_(actor) {
    at::set_num_threads(1);  // more are slower for such small networks
    for (const auto& [inputs, outputs] : policy::weight_blocks(actor.widths, actor.recurrent))
      shapes_.push_back({outputs, inputs + 1});
    numbers_ = of(actor.weights);
    first_ = torch::zeros_like(numbers_), second_ = torch::zeros_like(numbers_);
    numbers_.requires_grad_();
    mean_ = of(actor.mean), scale_ = of(actor.scale);
  }

  double learn(const Lessons& lessons, double rate) override {
    const auto steps = static_cast<std::int64_t>(lessons.actions), flights = static_cast<std::int64_t>(lessons.flights);
    const torch::Tensor seen = tensor(lessons.observation, {steps * flights, actor_.widths.front()});
    const torch::Tensor wanted = tensor(lessons.wanted, {steps * flights, actor_.widths.back()});
    const torch::Tensor counts = tensor(lessons.counts, {steps * flights, 1});
    const torch::Tensor done = act(((seen - mean_) * scale_).clamp(-actor_.clip, actor_.clip), steps, flights);
    const torch::Tensor loss =
        ((done - wanted).square() * counts).sum() / (counts.sum() * static_cast<double>(actor_.widths.back()));
    const torch::Tensor g = torch::autograd::grad({loss}, {numbers_})[0];
    const torch::NoGradGuard none;
    g.mul_((kLongestGradient / (g.norm() + 1e-9)).clamp_max(1));
    ++steps_;
    first_.mul_(kBeta1).add_(g, 1 - kBeta1);
    second_.mul_(kBeta2).addcmul_(g, g, 1 - kBeta2);
    const double root = 1 / std::sqrt(1 - std::pow(kBeta2, steps_));
    numbers_.addcdiv_(first_, second_.sqrt().mul_(root).add_(kEpsilon), -rate / (1 - std::pow(kBeta1, steps_)));
    return loss.item<double>();
  }

  std::vector<double> weights() const override {
    const torch::Tensor all = numbers_.detach().to(torch::kDouble);
    return {all.data_ptr<double>(), all.data_ptr<double>() + all.numel()};
  }

 private:
  static torch::Tensor of(const std::vector<double>& numbers) {
    return torch::from_blob(const_cast<double*>(numbers.data()), {static_cast<std::int64_t>(numbers.size())},
                            torch::kDouble)
        .to(torch::kFloat);
  }
  static torch::Tensor tensor(const std::vector<float>& numbers, at::IntArrayRef shape) {
    return torch::from_blob(const_cast<float*>(numbers.data()), shape, torch::kFloat);
  }

  /// `x`: [action * flight][input].
  torch::Tensor act(torch::Tensor x, std::int64_t steps, std::int64_t flights) const {
    std::vector<Rows> layers;
    std::int64_t at = 0;
    for (const auto& [outputs, row] : shapes_) {
      layers.push_back(numbers_.narrow(0, at, outputs * row).view({outputs, row}));
      at += outputs * row;
    }
    std::size_t layer = 0;
    if (actor_.recurrent) {
      const std::int64_t units = actor_.widths[1];
      const torch::Tensor seen = sums(layers[0], x).view({steps, flights, 3 * units});
      torch::Tensor memory = torch::zeros({flights, units});
      std::vector<torch::Tensor> all;
      for (std::int64_t t = 0; t < steps; ++t) {
        const auto of_seen = seen.select(0, t).chunk(3, 1), of_kept = sums(layers[1], memory).chunk(3, 1);
        const torch::Tensor fresh = torch::tanh(of_seen[2] + torch::sigmoid(of_seen[0] + of_kept[0]) * of_kept[2]);
        memory = fresh + torch::sigmoid(of_seen[1] + of_kept[1]) * (memory - fresh);
        all.push_back(memory);
      }
      x = torch::cat(all, 0);
      layer = 2;
    }
    for (; layer < layers.size(); ++layer) {
      x = sums(layers[layer], x);
      const bool last = layer + 1 == layers.size();
      x = last || actor_.hidden == policy::Activation::tanh ? torch::tanh(x) : torch::relu(x);
    }
    return x;
  }

  const policy::Actor actor_;
  std::vector<std::pair<std::int64_t, std::int64_t>> shapes_;  // [layer] outputs, and numbers of each
  torch::Tensor numbers_, first_, second_, mean_, scale_;
  int steps_ = 0;
};

}  // namespace

std::unique_ptr<TorchStudent> make_torch_student(const policy::Actor& actor) {
  return std::make_unique<Student>(actor);
}

}  // namespace flappy::learn
