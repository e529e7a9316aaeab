// TD3 (Fujimoto et al. 2018) and DDPG (Lillicrap et al. 2016): one gradient step on a batch sampled from a replay memory.
// For a transition (s, a, r, s') with discount d:
//   a' = clip(mu'(s') + clip(noise, +-noise_clip), +-1)
//   y  = r + d min_i Q'_i(s', a')
//   critics descend  mean (Q_i(s, a) - y)^2,  or the mean of its Huber loss
//   the actor, every policy_delay-th update, ascends  mean Q_1(s, mu(s))  by the critic as it was before this update
//   Adam (Kingma and Ba 2015); targets move by tau whenever the actor does
// DDPG: twin off, policy_delay 1, no noise. The bits are the same for any number of threads and any instruction set.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/ranks.hpp"
#include "learn/replay_buffer.hpp"
#include "policy/actor_file.hpp"

namespace flappy::learn {

/// Inputs of a network are clamp((observation - mean) * scale, +-clip).
struct Normaliser {
  std::vector<double> mean, scale;
  double clip = 10;
};

struct LearnerOptions {
  TransitionShape shape;
  std::vector<int> actor_hidden = {32, 32}, critic_hidden = {64, 64};  ///< widths
  policy::Activation actor_activation = policy::Activation::relu, critic_activation = policy::Activation::relu;
  Normaliser input;               ///< of the actor and the critics
  double last_layer_scale = 0.1;  ///< of the first weights of the actor's last layer and the critics'

  bool twin = true;
  int policy_delay = 2;
  double noise_sd = 0.2, noise_clip = 0.5;  ///< of the target's action; sd 0: none
  double tau = 0.005;
  double huber =
      0;  ///< where squares turn into lines (the loss is then e^2 / 2 below, as torch's huber_loss); 0: squares
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  std::size_t batch = 256;  ///< a multiple of kChunk

  std::uint64_t seed = 0;
  int threads = 1;
  io::Ranks* ranks = nullptr;   ///< do their shares of every batch; none: all of it is done here
  std::string instruction_set;  ///< empty: the best one

  // what LibTorch alone does
  bool layer_norm = false;                     ///< in all networks, before hidden activations
  double weight_decay = 0, gradient_clip = 0;  ///< AdamW's; largest norm of a gradient (0: none), the critics' together
  std::string device = "cpu";                  ///< or "cuda"
};

/// std::invalid_argument for options that make no learner.
void check_options(const LearnerOptions& options);

/// The first weight of this number, output by output, of a layer: uniform within +-scale/sqrt(inputs), as torch's nn.Linear; biases
/// are 0. `network`: 0 the actor's, then the critics'.
double first_weight(std::uint64_t seed, int network, int layer, int inputs, std::uint32_t number, double scale);

/// Further work for the threads of an update, behind its own: run(0) to run(items - 1), each once, in any order and at the
/// same time. run must neither throw nor touch what the update reads.
struct Companion {
  std::size_t items = 0;
  std::function<void(std::size_t)> run;
};

/// Of the last update, summed in a fixed order.
struct UpdateMetrics {
  double critic_loss = 0;  ///< mean over critics and batch; not finite when something is broken
  double mean_q = 0;       ///< of Q_1(s, a)
  double actor_q = 0;      ///< of Q_1(s, mu(s)), when the actor last learnt
};

/// What a learner counts. Powers of beta are running products, so that a resumed run has their very bits.
struct LearnerCounters {
  std::uint64_t updates = 0;
  double critic_beta1 = 1, critic_beta2 = 1, actor_beta1 = 1, actor_beta2 = 1;
};

template <class T>
class Learner {
 public:
  /// std::invalid_argument for options that make no learner, or an instruction set that this processor has not.
  explicit Learner(const LearnerOptions& options);
  ~Learner();
  Learner(Learner&&) noexcept;
  Learner& operator=(Learner&&) noexcept;

  /// One gradient step, at the given rates of Adam. Allocates nothing. std::invalid_argument where `replay` is empty or has
  /// another shape.
  void update(const Replay& replay, double actor_rate, double critic_rate, const Companion& beside = {});

  const LearnerOptions& options() const;
  const UpdateMetrics& metrics() const;

  /// The actor as it is; task and names of inputs and outputs are left to the caller.
  policy::Actor actor() const;
  /// Starts from this actor instead: weights and target's. std::invalid_argument where its shape is another.
  void set_actor(const policy::Actor& actor);
  /// Actions of `count` observations, row by row: what flight::evaluate gives, to the bit.
  void act(const float* observations, std::size_t count, T* actions) const;

  /// All that updates change, for checkpoints: weights, targets and Adam's moments of critics and actor; and the counters.
  std::span<T> numbers();
  std::span<const T> numbers() const;
  LearnerCounters& counters();
  const LearnerCounters& counters() const;

  /// The numbers of one layer: [1 + inputs][padded], the first row is the bias.
  struct Layer {
    std::span<const T> numbers;
    int inputs, outputs, padded;
  };
  enum class Network { critic_1, critic_2, actor };
  enum class Kind { weights, targets, first_moments, second_moments };
  std::vector<Layer> layers(Network network, Kind kind = Kind::weights) const;

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

extern template class Learner<float>;
extern template class Learner<double>;

}  // namespace flappy::learn
