#include "learn/torch/torch_learner.hpp"

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/csrc/autograd/autograd.h>
#include <torch/csrc/autograd/generated/variable_factories.h>
#include <torch/cuda.h>
#include <torch/nn/functional/loss.h>
#include <torch/version.h>

#include <filesystem>

#include "io/files.hpp"

extern "C" {
void sgemm_();  // from the BLAS that LibTorch uses on this system
void openblas_set_num_threads(int) __attribute__((weak));
}

namespace flappy::learn {
namespace {

/// Its tensors are views of those with the numbers of all networks, so that a step is a few operations on one tensor.
struct Perceptron {
  std::vector<torch::Tensor> weights, biases, gains, shifts;  // gains and shifts only with layer norm
  policy::Activation hidden;
  bool bounded;

  torch::Tensor forward(torch::Tensor x) const {
    for (std::size_t l = 0; l < weights.size(); ++l) {
      x = torch::addmm(biases[l], x, weights[l].t());
      if (l + 1 == weights.size()) break;
      if (!gains.empty()) x = torch::layer_norm(x, {x.size(1)}, gains[l], shifts[l], policy::kLayerNormEpsilon);
      switch (hidden) {
        case policy::Activation::relu:
          x = torch::relu(x);
          break;
        case policy::Activation::tanh:
          x = torch::tanh(x);
          break;
        case policy::Activation::elu:
          x = torch::elu(x);
          break;
        case policy::Activation::silu:
          x = torch::silu(x);
          break;
      }
    }
    return bounded ? torch::tanh(x) : x;
  }
  std::vector<torch::Tensor> parameters() const {
    std::vector<torch::Tensor> all;
    for (const auto* list : {&weights, &biases, &gains, &shifts}) all.insert(all.end(), list->begin(), list->end());
    return all;
  }
};

struct Shape {
  std::vector<int> widths;
  policy::Activation hidden;
  bool layer_norm, bounded;
  std::int64_t normed(std::size_t layer) const { return layer_norm && layer + 2 < widths.size() ? 2 : 0; }
  std::int64_t count() const {
    std::int64_t n = 0;
    for (std::size_t l = 0; l + 1 < widths.size(); ++l) n += (1 + widths[l] + normed(l)) * widths[l + 1];
    return n;
  }
};

/// The network whose numbers begin at index `at` of `numbers`: for each layer weights [out][in], biases, gains, shifts.
Perceptron network(const Shape& s, const torch::Tensor& numbers, std::int64_t at) {
  Perceptron p{{}, {}, {}, {}, s.hidden, s.bounded};
  const auto take = [&](std::int64_t count) {
    at += count;
    return numbers.narrow(0, at - count, count).detach();
  };
  for (std::size_t l = 0; l + 1 < s.widths.size(); ++l) {
    const std::int64_t in = s.widths[l], out = s.widths[l + 1];
    p.weights.push_back(take(in * out).view({out, in}));
    p.biases.push_back(take(out));
    if (s.normed(l) == 0) continue;
    p.gains.push_back(take(out));
    p.shifts.push_back(take(out));
  }
  return p;
}

class Learner : public TorchLearner {
 public:
  Learner(const LearnerOptions& o, bool twice)
      : o_(o), as_(torch::device(o.device).dtype(twice ? torch::kDouble : torch::kFloat)) {
    alone();
    const auto widths = [](int inputs, std::vector<int> list, int outputs) {
      list.insert(list.begin(), inputs);
      list.push_back(outputs);
      return list;
    };
    for (int c = 0; c < (o.twin ? 2 : 1); ++c)
      shapes_.push_back(
          {widths(o.shape.observation + o.shape.action, o.critic_hidden, 1), o.critic_activation, o.layer_norm, false});
    shapes_.push_back(
        {widths(o.shape.observation, o.actor_hidden, o.shape.action), o.actor_activation, o.layer_norm, true});
    std::int64_t count = 0;
    for (const Shape& s : shapes_) count += s.count();
    for (torch::Tensor& t : numbers_) t = torch::zeros({count}, as_);
    gradients_ = torch::zeros({count}, as_);
    std::int64_t at = 0;
    for (const Shape& s : shapes_) {
      networks_.push_back(network(s, numbers_[0], at));
      targets_.push_back(network(s, numbers_[1], at));
      const std::vector<torch::Tensor> own = networks_.back().parameters();
      const std::vector<torch::Tensor> slopes = network(s, gradients_, at).parameters();
      for (std::size_t i = 0; i < own.size(); ++i) own[i].requires_grad_().mutable_grad() = slopes[i];
      actor_at_ = at;
      at += s.count();
    }
    mean_ = of(o.input.mean), scale_ = of(o.input.scale);
  }

  UpdateMetrics differentiate(const Replay& replay, const Batch& batch, double share) override {
    alone();
    const TransitionLayout& layout = replay.layout();
    const auto b = static_cast<std::int64_t>(batch.rows.size());
    const torch::Tensor memory =
        torch::from_blob(const_cast<float*>(replay.row(0)),
                         {static_cast<std::int64_t>(replay.capacity()), static_cast<std::int64_t>(layout.row)});
    const torch::Tensor index = torch::from_blob(const_cast<std::uint32_t*>(batch.rows.data()), {b}, torch::kInt);
    const torch::Tensor rows = memory.index_select(0, index).to(as_);
    const auto part = [&](std::size_t first, int count) {
      return rows.narrow(1, static_cast<std::int64_t>(first), count);
    };
    torch::Tensor goal;
    {
      const torch::NoGradGuard none;
      const torch::Tensor seen_next = see(part(layout.next_observation, inputs()));
      torch::Tensor next = targets_.back().forward(seen_next);
      if (!batch.noise.empty()) {
        const torch::Tensor n = torch::from_blob(const_cast<float*>(batch.noise.data()), next.sizes()).to(as_);
        next = (next + (n * o_.noise_sd).clamp(-o_.noise_clip, o_.noise_clip)).clamp(-1, 1);
      }
      const torch::Tensor in = torch::cat({seen_next, next}, 1);
      torch::Tensor q = targets_[0].forward(in);
      if (o_.twin) q = torch::min(q, targets_[1].forward(in));
      goal = torch::addcmul(part(layout.reward, 1), part(layout.discount, 1), q);
    }
    gradients_.zero_();
    UpdateMetrics m;
    const torch::Tensor seen = see(part(layout.observation, inputs()));
    if (batch.actor_learns) {  // with the critic before its step; only the actor's gradient is computed
      const torch::Tensor q = networks_[0].forward(torch::cat({seen, networks_.back().forward(seen)}, 1));
      const std::vector<torch::Tensor> parameters = networks_.back().parameters();
      const torch::Tensor loss = -share * q.mean();
      const auto slopes = torch::autograd::grad({loss}, parameters);
      const torch::NoGradGuard none;
      for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i].mutable_grad().copy_(slopes[i]);
      m.actor_q = -loss.item<double>();
    }
    const torch::Tensor in = torch::cat({seen, part(layout.action, o_.shape.action)}, 1);
    torch::Tensor loss;
    for (std::size_t c = 0; c + 1 < networks_.size(); ++c) {
      const torch::Tensor q = networks_[c].forward(in);
      if (c == 0) m.mean_q = share * q.detach().mean().item<double>();
      const torch::Tensor own =
          o_.huber > 0 ? torch::huber_loss(q, goal, at::Reduction::Mean, o_.huber) : torch::mse_loss(q, goal);
      loss = loss.defined() ? loss + own : own;
    }
    loss = share * loss;
    loss.backward();
    m.critic_loss = loss.item<double>() / static_cast<double>(networks_.size() - 1);
    return m;
  }

  void step(const Batch& batch) override {
    alone();
    const torch::NoGradGuard none;
    adam(0, actor_at_, batch.critic);
    if (batch.actor_learns) {
      adam(actor_at_, gradients_.size(0) - actor_at_, batch.actor);
      numbers_[1].lerp_(numbers_[0], o_.tau);
    }
  }

  void get_gradients(std::span<float> to) const override {
    const torch::Tensor numbers = gradients_.to(torch::kCPU, torch::kFloat);
    std::copy_n(numbers.data_ptr<float>(), to.size(), to.begin());
  }
  void set_gradients(std::span<const float> from) override {
    gradients_.copy_(torch::from_blob(const_cast<float*>(from.data()), {static_cast<std::int64_t>(from.size())}));
  }

  void act(const float* observations, std::size_t count, float* actions) const override {
    alone();
    const torch::NoGradGuard none;
    const torch::Tensor in =
        torch::from_blob(const_cast<float*>(observations), {static_cast<std::int64_t>(count), std::int64_t{inputs()}});
    const torch::Tensor out = networks_.back().forward(see(in.to(as_))).to(torch::kCPU, torch::kFloat).contiguous();
    std::copy_n(out.data_ptr<float>(), out.numel(), actions);
  }

  std::size_t count() const override { return static_cast<std::size_t>(gradients_.size(0)); }
  void get(Kind kind, std::span<double> to) const override {
    const torch::Tensor numbers = numbers_[static_cast<std::size_t>(kind)].to(torch::kCPU, torch::kDouble);
    const double* from = numbers.data_ptr<double>();
    visit([&](std::size_t outside, std::size_t inside) { to[outside] = from[inside]; });
  }
  void set(Kind kind, std::span<const double> from) override {
    const torch::Tensor numbers = torch::empty({gradients_.size(0)}, torch::kDouble);
    double* to = numbers.data_ptr<double>();
    visit([&](std::size_t outside, std::size_t inside) { to[inside] = from[outside]; });
    numbers_[static_cast<std::size_t>(kind)].copy_(numbers);
  }

 private:
  int inputs() const { return o_.shape.observation; }
  torch::Tensor see(const torch::Tensor& x) const {
    return ((x - mean_) * scale_).clamp_(-o_.input.clip, o_.input.clip);
  }
  torch::Tensor of(std::span<const double> numbers) const {
    const auto count = static_cast<std::int64_t>(numbers.size());
    return torch::from_blob(const_cast<double*>(numbers.data()), {count}, torch::kDouble).to(as_);
  }
  /// Adam (Kingma and Ba 2015, arXiv 1412.6980) for `count` numbers from `at`. First limits the gradient's norm; weight
  /// decay is decoupled (Loshchilov and Hutter 2019, arXiv 1711.05101).
  void adam(std::int64_t at, std::int64_t count, const Step& step) {
    const auto part = [&](const torch::Tensor& t) { return t.narrow(0, at, count); };
    const torch::Tensor g = part(gradients_), m = part(numbers_[2]), v = part(numbers_[3]), x = part(numbers_[0]);
    if (o_.gradient_clip > 0) g.mul_((o_.gradient_clip / (g.norm() + 1e-6)).clamp_max(1));
    if (o_.weight_decay > 0) x.mul_(1 - step.rate * o_.weight_decay);
    m.mul_(o_.beta1).add_(g, 1 - o_.beta1);
    v.mul_(o_.beta2).addcmul_(g, g, 1 - o_.beta2);
    x.addcdiv_(m, v.sqrt().mul_(step.root).add_(o_.epsilon), -step.rate * step.first);
  }
  /// Makes LibTorch and its BLAS use the calling thread only, because the other threads fly at the same time.
  static void alone() {
    if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
    at::set_num_threads(1);
  }
  /// Calls visit(index outside, index inside). Outside, in actor files, an output's bias precedes its weights.
  template <class Visit>
  void visit(const Visit& visit) const {
    std::size_t outside = 0, at = 0;
    for (const Shape& s : shapes_)
      for (std::size_t l = 0; l + 1 < s.widths.size(); ++l) {
        const auto in = static_cast<std::size_t>(s.widths[l]), out = static_cast<std::size_t>(s.widths[l + 1]);
        for (std::size_t o = 0; o < out; ++o) {
          visit(outside++, at + in * out + o);
          for (std::size_t i = 0; i < in; ++i) visit(outside++, at + o * in + i);
        }
        at += (1 + in) * out;
        for (std::size_t k = static_cast<std::size_t>(s.normed(l)) * out; k > 0; --k) visit(outside++, at++);
      }
  }

  LearnerOptions o_;
  torch::TensorOptions as_;    // device and precision of all tensors
  std::vector<Shape> shapes_;  // critics, then the actor
  torch::Tensor numbers_[4], gradients_;
  std::int64_t actor_at_ = 0;
  std::vector<Perceptron> networks_, targets_;
  torch::Tensor mean_, scale_;
};

std::unique_ptr<TorchLearner> make(const LearnerOptions& options, bool twice) {
  if (options.device == "cuda" && !torch::cuda::is_available())
    throw io::InputError("learn.device: is cuda, which this LibTorch or this machine has not; accepted: \"cpu\"");
  return std::make_unique<Learner>(options, twice);
}

std::string version() {
  Dl_info blas{};
  const bool known = dladdr(reinterpret_cast<void*>(sgemm_), &blas) != 0;
  return TORCH_VERSION + (known ? " with " + std::filesystem::canonical(blas.dli_fname).string() : std::string());
}

}  // namespace

const TorchLearnerFunctions flappy_torch_learner_functions = {make, make_torch_student, version};

}  // namespace flappy::learn
