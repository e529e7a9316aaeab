#include "learn/engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "io/files.hpp"
#include "io/parallel.hpp"
#include "io/plugin.hpp"
#include "learn/torch/torch_learner.hpp"
#include "sim/kernels.hpp"
#include "sim/noise.hpp"
#include "sim/random.hpp"

namespace flappy::learn {
namespace {

void check_numbers(std::span<const float> numbers, std::size_t count) {
  if (numbers.size() != count) throw std::invalid_argument("holds the numbers of other networks");
  if (!std::ranges::all_of(numbers, [](float x) { return std::isfinite(x); }))
    throw std::invalid_argument("holds numbers that are not finite");
}

class LanesEngine : public LearnerEngine {
 public:
  explicit LanesEngine(const LearnerOptions& options) : learner_(options) {}
  void update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside) override {
    learner_.update(replay, actor_rate, critic_rate, beside);
  }
  const UpdateMetrics& metrics() const override { return learner_.metrics(); }
  policy::Actor actor() const override { return learner_.actor(); }
  void set_actor(const policy::Actor& actor) override { learner_.set_actor(actor); }
  void act(const float* observations, std::size_t count, float* actions) const override {
    learner_.act(observations, count, actions);
  }
  std::vector<float> save() const override { return {learner_.numbers().begin(), learner_.numbers().end()}; }
  void load(std::span<const float> numbers) override {
    check_numbers(numbers, learner_.numbers().size());
    std::ranges::copy(numbers, learner_.numbers().begin());
  }
  LearnerCounters& counters() override { return learner_.counters(); }
  std::string describe() const override {
    return "lanes: the same bytes on every processor, for any number of threads";
  }

 private:
  Learner<float> learner_;
};

constexpr const char* kPlugin = "torch_learner";

/// Draws the lanes' samples and noise. One item of a parallel loop is the update; other threads do the work `beside`.
class TorchEngine : public LearnerEngine {
 public:
  explicit TorchEngine(const LearnerOptions& o)
      : o_(o), rows_(o.batch), noise_(o.noise_sd > 0 ? o.batch * static_cast<std::size_t>(o.shape.action) : 0) {
    check_options(o);
    if (o.ranks != nullptr && static_cast<std::size_t>(o.ranks->size()) > o.batch)
      throw io::InputError("learn.batch: is less than one sample for each of " + std::to_string(o.ranks->size()) +
                           " ranks; accepted: a larger one, or fewer ranks");
    learner_ = torch_functions().make(o, false);
    std::vector<double> weights;
    for (int c = 0; c < (o.twin ? 2 : 1); ++c)
      start(1 + c, o.shape.observation + o.shape.action, o.critic_hidden, 1, weights);
    actor_at_ = weights.size();
    blank_.widths = start(0, o.shape.observation, o.actor_hidden, o.shape.action, weights);
    blank_.hidden = o.actor_activation;
    blank_.layer_norm = o.layer_norm;
    blank_.mean = o.input.mean, blank_.scale = o.input.scale, blank_.clip = o.input.clip;
    learner_->set(TorchLearner::Kind::weights, weights);
    learner_->set(TorchLearner::Kind::targets, weights);
  }

  void update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside) override {
    const TransitionShape &have = replay.shape(), &want = o_.shape;
    if (replay.size() == 0 || have.observation != want.observation || have.action != want.action)
      throw std::invalid_argument("a replay memory that is empty or of another shape");
    LearnerCounters& n = counters_;
    const bool actor_learns = (n.updates + 1) % static_cast<std::uint64_t>(o_.policy_delay) == 0;
    n.critic_beta1 *= o_.beta1, n.critic_beta2 *= o_.beta2;
    if (actor_learns) n.actor_beta1 *= o_.beta1, n.actor_beta2 *= o_.beta2;
    const auto step = [](double rate, double beta1, double beta2) {
      return TorchLearner::Step{rate, 1 / (1 - beta1), 1 / std::sqrt(1 - beta2)};
    };
    const auto [first, last] = io::own_share(o_.ranks, o_.batch);
    const std::size_t actions = noise_.size() / o_.batch;
    const TorchLearner::Batch batch{
        std::span(rows_).subspan(first, last - first),
        std::span(noise_).subspan(first * actions, (last - first) * actions), actor_learns,
        actor_learns ? step(actor_rate, n.actor_beta1, n.actor_beta2) : TorchLearner::Step{},
        step(critic_rate, n.critic_beta1, n.critic_beta2)};
    UpdateMetrics now;
    io::parallel_for(1 + beside.items, o_.threads, [&](std::size_t i) {
      if (i > 0) return beside.run(i - 1);
      replay.sample(o_.seed, n.updates, 0, rows_);
      draw_noise();
      now = learner_->differentiate(replay, batch,
                                    static_cast<double>(batch.rows.size()) / static_cast<double>(o_.batch));
      if (o_.ranks == nullptr) learner_->step(batch);
    });
    if (o_.ranks != nullptr) {
      exchange(now);
      learner_->step(batch);
    }
    if (!actor_learns) now.actor_q = metrics_.actor_q;
    metrics_ = now;
    ++n.updates;
  }
  const UpdateMetrics& metrics() const override { return metrics_; }

  policy::Actor actor() const override {
    policy::Actor a = blank_;
    const std::vector<double> all = numbers(TorchLearner::Kind::weights);
    a.weights.assign(all.begin() + static_cast<std::ptrdiff_t>(actor_at_), all.end());
    return a;
  }
  void set_actor(const policy::Actor& a) override {
    if (a.widths != blank_.widths || a.hidden != blank_.hidden || a.layer_norm != blank_.layer_norm ||
        a.linear != blank_.linear || a.recurrent != blank_.recurrent ||
        actor_at_ + a.weights.size() != learner_->count())
      throw std::invalid_argument("the actor's layers are not those of the learner");
    for (const TorchLearner::Kind kind : {TorchLearner::Kind::weights, TorchLearner::Kind::targets}) {
      std::vector<double> all = numbers(kind);
      std::ranges::copy(a.weights, all.begin() + static_cast<std::ptrdiff_t>(actor_at_));
      learner_->set(kind, all);
    }
  }
  void act(const float* observations, std::size_t count, float* actions) const override {
    learner_->act(observations, count, actions);
  }

  std::vector<float> save() const override {
    std::vector<float> all;
    for (const TorchLearner::Kind kind : kKinds)
      for (const double x : numbers(kind)) all.push_back(static_cast<float>(x));
    return all;
  }
  void load(std::span<const float> all) override {
    const std::size_t count = learner_->count();
    check_numbers(all, std::size(kKinds) * count);
    for (const TorchLearner::Kind kind : kKinds) {
      learner_->set(kind, std::vector<double>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count)));
      all = all.subspan(count);
    }
  }
  LearnerCounters& counters() override { return counters_; }
  std::string describe() const override {
    return "libtorch " + torch_functions().version() +
           ": the same bytes for the same build and processor, for any number of threads";
  }

 private:
  /// Sums gradients and metrics over all ranks, in the order of ranks.
  void exchange(UpdateMetrics& metrics) {
    const std::size_t count = learner_->count(), numbers = count + 3;
    std::vector<float> mine(numbers), all(numbers * static_cast<std::size_t>(o_.ranks->size()));
    learner_->get_gradients(std::span(mine).first(count));
    mine[count] = static_cast<float>(metrics.critic_loss), mine[count + 1] = static_cast<float>(metrics.mean_q);
    mine[count + 2] = static_cast<float>(metrics.actor_q);
    o_.ranks->all_gather(std::as_bytes(std::span(mine)), std::as_writable_bytes(std::span(all)));
    std::ranges::copy(std::span(all).first(numbers), mine.begin());
    for (std::size_t k = numbers; k < all.size(); ++k) mine[k % numbers] += all[k];
    learner_->set_gradients(std::span(mine).first(count));
    metrics = {mine[count], mine[count + 1], mine[count + 2]};
  }

  static constexpr TorchLearner::Kind kKinds[] = {TorchLearner::Kind::weights, TorchLearner::Kind::targets,
                                                  TorchLearner::Kind::first_moments,
                                                  TorchLearner::Kind::second_moments};

  /// Appends the initial weights of a network to `to`, the same as those of the lanes. Returns its widths.
  std::vector<int> start(int network, int inputs, const std::vector<int>& hidden, int outputs,
                         std::vector<double>& to) const {
    std::vector<int> widths = {inputs};
    widths.insert(widths.end(), hidden.begin(), hidden.end());
    widths.push_back(outputs);
    for (std::size_t l = 0; l + 1 < widths.size(); ++l) {
      const bool last = l + 2 == widths.size();
      std::uint32_t number = 0;
      for (int out = 0; out < widths[l + 1]; ++out) {
        to.push_back(0);
        for (int in = 0; in < widths[l]; ++in)
          to.push_back(static_cast<float>(first_weight(o_.seed, network, static_cast<int>(l), widths[l], number++,
                                                       last ? o_.last_layer_scale : 1)));
      }
      if (!o_.layer_norm || last) continue;
      to.insert(to.end(), static_cast<std::size_t>(widths[l + 1]), 1);
      to.insert(to.end(), static_cast<std::size_t>(widths[l + 1]), 0);
    }
    return widths;
  }
  std::vector<double> numbers(TorchLearner::Kind kind) const {
    std::vector<double> all(learner_->count());
    learner_->get(kind, all);
    return all;
  }

  /// Draws the standard normals that the lanes use, [batch][actions].
  void draw_noise() {
    if (noise_.empty()) return;
    constexpr int kWide = 4;
    using L = model::Lanes<float, kWide>;
    const auto actions = static_cast<std::size_t>(o_.shape.action);
    for (std::size_t s = 0; s < o_.batch; s += kWide) {
      std::uint32_t number[kWide], update[kWide];
      for (std::uint32_t i = 0; i < kWide; ++i)
        number[i] = static_cast<std::uint32_t>(s) + i, update[i] = static_cast<std::uint32_t>(counters_.updates);
      for (std::size_t first = 0; first < actions; first += 4) {
        const auto normal = sim::normals<L>(o_.seed, static_cast<std::uint32_t>(sim::Stream::target_noise),
                                            static_cast<std::uint32_t>(first / 4), number, update);
        for (std::size_t k = 0; k < 4 && first + k < actions; ++k)
          for (std::size_t i = 0; i < kWide; ++i) noise_[(s + i) * actions + first + k] = normal.n[k].raw[i];
      }
    }
  }

  LearnerOptions o_;
  std::vector<std::uint32_t> rows_;
  std::vector<float> noise_;
  std::size_t actor_at_ = 0;  // index of the actor's first weight
  policy::Actor blank_;
  std::unique_ptr<TorchLearner> learner_;
  LearnerCounters counters_;
  UpdateMetrics metrics_;
};

}  // namespace

const TorchLearnerFunctions& torch_functions() {
  static const auto* const functions = io::plugin<TorchLearnerFunctions>(
      kPlugin, "flappy_torch_learner_functions",
      "learn.engine: libtorch is not in this build; accepted: \"lanes\", the package "
      "flappy-torch, or all that scripts/build builds where libtorch-dev is installed");
  return *functions;
}

bool has_libtorch() { return io::has_plugin(kPlugin); }

std::unique_ptr<LearnerEngine> make_engine(EngineKind kind, const LearnerOptions& options) {
  if (kind == EngineKind::libtorch) return std::make_unique<TorchEngine>(options);
  return std::make_unique<LanesEngine>(options);
}

}  // namespace flappy::learn
