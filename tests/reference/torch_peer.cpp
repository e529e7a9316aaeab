#include "torch_peer.hpp"

#include <dlfcn.h>
#include <torch/csrc/autograd/autograd.h>
#include <torch/csrc/autograd/generated/variable_factories.h>
#include <torch/nn/modules/linear.h>
#include <torch/optim/adam.h>
#include <torch/utils.h>
#include <torch/version.h>

#include <filesystem>

extern "C" {
void sgemm_();  // of whichever BLAS the system gives LibTorch
void openblas_set_num_threads(int) __attribute__((weak));
}

namespace flappy::reference {
namespace {

using learn::LearnerOptions;

/// A multilayer perceptron of torch's own modules.
struct Perceptron : torch::nn::Module {
  std::vector<torch::nn::Linear> layers;
  bool tanh_hidden, bounded;

  Perceptron(const std::vector<int>& widths, policy::Activation hidden, bool is_bounded, torch::Dtype type,
             const TorchLearner::Numbers& start)
      : tanh_hidden(hidden == policy::Activation::tanh), bounded(is_bounded) {
    for (std::size_t l = 0; l + 1 < widths.size(); ++l)
      layers.push_back(register_module("layer" + std::to_string(l), torch::nn::Linear(widths[l], widths[l + 1])));
    to(type);
    const torch::NoGradGuard none;
    std::size_t next = 0;
    for (auto& layer : layers)
      for (std::int64_t o = 0; o < layer->bias.size(0); ++o) {
        layer->bias[o] = start.at(next++);
        for (std::int64_t i = 0; i < layer->weight.size(1); ++i) layer->weight[o][i] = start.at(next++);
      }
  }
  torch::Tensor forward(torch::Tensor x) {
    for (std::size_t l = 0; l < layers.size(); ++l) {
      x = layers[l]->forward(x);
      if (l + 1 < layers.size()) x = tanh_hidden ? torch::tanh(x) : torch::relu(x);
    }
    return bounded ? torch::tanh(x) : x;
  }
  template <class Pick>
  TorchLearner::Numbers numbers(const Pick& pick) const {
    TorchLearner::Numbers list;
    for (const auto& layer : layers) {
      const torch::Tensor b = pick(layer->bias).to(torch::kDouble), w = pick(layer->weight).to(torch::kDouble);
      for (std::int64_t o = 0; o < b.size(0); ++o) {
        list.push_back(b[o].item<double>());
        for (std::int64_t i = 0; i < w.size(1); ++i) list.push_back(w[o][i].item<double>());
      }
    }
    return list;
  }
};

void set_rate(torch::optim::Adam& adam, double rate) {
  static_cast<torch::optim::AdamOptions&>(adam.param_groups()[0].options()).lr(rate);
}

void follow(Perceptron& target, const Perceptron& leader, double tau) {
  const torch::NoGradGuard none;
  const auto to = target.parameters(), from = leader.parameters();
  for (std::size_t i = 0; i < to.size(); ++i) torch::Tensor(to[i]).lerp_(from[i], tau);
}

}  // namespace

struct TorchLearner::Storage {
  LearnerOptions o;
  torch::Dtype type;
  torch::Tensor seen, action, reward, discount, next_seen;  // of all transitions
  torch::Tensor mean, scale;
  std::vector<std::shared_ptr<Perceptron>> critics, critic_targets;
  std::shared_ptr<Perceptron> actor, actor_target;
  std::unique_ptr<torch::optim::Adam> critic_adam, actor_adam;
  std::uint64_t updates = 0;
  double loss = 0;

  torch::Tensor tensor(const std::vector<double>& x) const { return torch::tensor(x, torch::kDouble).to(type); }
  torch::Tensor see(const torch::Tensor& x) const { return ((x - mean) * scale).clamp(-o.input.clip, o.input.clip); }
};

TorchLearner::TorchLearner(const LearnerOptions& o, const learn::Replay& replay, bool twice,
                           const std::array<Numbers, 3>& start)
    : storage_(std::make_unique<Storage>()) {
  version();
  Storage& s = *storage_;
  s.o = o;
  s.type = twice ? torch::kDouble : torch::kFloat;
  const learn::TransitionLayout& at = replay.layout();
  const torch::Tensor all =
      torch::from_blob(const_cast<float*>(replay.row(0)),
                       {static_cast<std::int64_t>(replay.size()), static_cast<std::int64_t>(at.row)}, torch::kFloat)
          .to(s.type);
  const auto columns = [&](std::size_t first, int count) {
    return all.narrow(1, static_cast<std::int64_t>(first), count).contiguous();
  };
  s.seen = columns(at.observation, o.shape.observation);
  s.action = columns(at.action, o.shape.action);
  s.reward = columns(at.reward, 1);
  s.discount = columns(at.discount, 1);
  s.next_seen = columns(at.next_observation, o.shape.observation);
  s.mean = s.tensor(o.input.mean), s.scale = s.tensor(o.input.scale);

  const auto widths = [](int inputs, std::vector<int> list, int outputs) {
    list.insert(list.begin(), inputs);
    list.push_back(outputs);
    return list;
  };
  const auto actor = [&] {
    return std::make_shared<Perceptron>(widths(o.shape.observation, o.actor_hidden, o.shape.action), o.actor_activation,
                                        true, s.type, start[2]);
  };
  s.actor = actor(), s.actor_target = actor();
  std::vector<torch::Tensor> parameters;
  for (int c = 0; c < (o.twin ? 2 : 1); ++c) {
    for (auto* list : {&s.critics, &s.critic_targets})
      list->push_back(std::make_shared<Perceptron>(widths(o.shape.observation + o.shape.action, o.critic_hidden, 1),
                                                   o.critic_activation, false, s.type,
                                                   start.at(static_cast<std::size_t>(c))));
    for (const auto& p : s.critics.back()->parameters()) parameters.push_back(p);
  }
  const auto options = torch::optim::AdamOptions().betas({o.beta1, o.beta2}).eps(o.epsilon);
  s.critic_adam = std::make_unique<torch::optim::Adam>(parameters, options);
  s.actor_adam = std::make_unique<torch::optim::Adam>(s.actor->parameters(), options);
}

TorchLearner::~TorchLearner() = default;

void TorchLearner::update(std::span<const std::uint32_t> rows, std::span<const double> noise, double actor_rate,
                          double critic_rate) {
  Storage& s = *storage_;
  const LearnerOptions& o = s.o;
  const bool actor_learns = (s.updates + 1) % static_cast<std::uint64_t>(o.policy_delay) == 0;
  const torch::Tensor index = torch::empty({static_cast<std::int64_t>(rows.size())}, torch::kLong);
  std::copy(rows.begin(), rows.end(), index.data_ptr<std::int64_t>());
  const auto pick = [&](const torch::Tensor& all) { return all.index_select(0, index); };

  torch::Tensor goal;
  {
    const torch::NoGradGuard none;
    const torch::Tensor next_seen = s.see(pick(s.next_seen));
    torch::Tensor next = s.actor_target->forward(next_seen);
    if (o.noise_sd > 0) {
      const torch::Tensor n =
          noise.empty() ? torch::randn_like(next)
                        : torch::from_blob(const_cast<double*>(noise.data()), next.sizes(), torch::kDouble).to(s.type);
      next = (next + (n * o.noise_sd).clamp(-o.noise_clip, o.noise_clip)).clamp(-1, 1);
    }
    const torch::Tensor in = torch::cat({next_seen, next}, 1);
    torch::Tensor q = s.critic_targets[0]->forward(in);
    if (o.twin) q = torch::min(q, s.critic_targets[1]->forward(in));
    goal = pick(s.reward) + pick(s.discount) * q;
  }
  const torch::Tensor seen = s.see(pick(s.seen));
  if (actor_learns) {  // by the critic as it is before its step
    const torch::Tensor q = s.critics[0]->forward(torch::cat({seen, s.actor->forward(seen)}, 1));
    const auto parameters = s.actor->parameters();
    const auto slopes = torch::autograd::grad({-q.mean()}, parameters);
    for (std::size_t i = 0; i < parameters.size(); ++i) torch::Tensor(parameters[i]).mutable_grad() = slopes[i];
  }
  s.critic_adam->zero_grad();
  const torch::Tensor in = torch::cat({seen, pick(s.action)}, 1);
  torch::Tensor loss;
  for (const auto& critic : s.critics) {
    const torch::Tensor q = critic->forward(in);
    const torch::Tensor own =
        o.huber > 0 ? torch::huber_loss(q, goal, at::Reduction::Mean, o.huber) : torch::mse_loss(q, goal);
    loss = loss.defined() ? loss + own : own;
  }
  loss.backward();
  s.loss = loss.item<double>() / static_cast<double>(s.critics.size());

  set_rate(*s.critic_adam, critic_rate);
  s.critic_adam->step();
  if (actor_learns) {
    set_rate(*s.actor_adam, actor_rate);
    s.actor_adam->step();
    follow(*s.actor_target, *s.actor, o.tau);
    for (std::size_t c = 0; c < s.critics.size(); ++c) follow(*s.critic_targets[c], *s.critics[c], o.tau);
  }
  ++s.updates;
}

namespace {
const torch::Tensor& itself(const torch::Tensor& t) { return t; }
}  // namespace

TorchLearner::Numbers TorchLearner::weights(Network network) const {
  return (network == Network::actor ? storage_->actor : storage_->critics.at(static_cast<std::size_t>(network)))
      ->numbers(itself);
}
TorchLearner::Numbers TorchLearner::targets(Network network) const {
  return (network == Network::actor ? storage_->actor_target
                                    : storage_->critic_targets.at(static_cast<std::size_t>(network)))
      ->numbers(itself);
}
TorchLearner::Numbers TorchLearner::gradients(Network network) const {
  return (network == Network::actor ? storage_->actor : storage_->critics.at(static_cast<std::size_t>(network)))
      ->numbers([](const torch::Tensor& t) { return t.grad(); });
}
double TorchLearner::critic_loss() const { return storage_->loss; }

std::string TorchLearner::version() {
  if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
  torch::set_num_threads(1);
  Dl_info blas{};
  const bool known = dladdr(reinterpret_cast<void*>(sgemm_), &blas) != 0;
  return TORCH_VERSION + (known ? " with " + std::filesystem::canonical(blas.dli_fname).string() : std::string());
}

}  // namespace flappy::reference
