// TD3 (Fujimoto et al. 2018) and DDPG (Lillicrap et al. 2016): one gradient step on a batch from a replay memory.
// For a transition (s, a, r, s') with discount d:
//   a' = clip(mu'(s') + clip(noise, +-noise_clip), +-1)
//   y  = r + d min_i Q'_i(s', a')
//   critics minimise  mean (Q_i(s, a) - y)^2,  or the mean Huber loss
//   the actor, in every policy_delay-th update, maximises  mean Q_1(s, mu(s)),  with the critic before this update
//   Adam (Kingma and Ba 2015); targets move by tau in the updates in which the actor learns
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
  Normaliser input;               ///< of the observations, for actor and critics
  double last_layer_scale = 0.1;  ///< scale of the initial weights in the last layers of actor and critics

  bool twin = true;
  int policy_delay = 2;
  double noise_sd = 0.2, noise_clip = 0.5;  ///< noise on the target actor's action; sd 0: none
  double tau = 0.005;
  /// The loss is e^2 / 2 up to this error and linear beyond, as in torch's huber_loss; 0: e^2 everywhere.
  double huber = 0;
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  std::size_t batch = 256;  ///< a multiple of kChunk

  std::uint64_t seed = 0;
  int threads = 1;
  io::Ranks* ranks = nullptr;   ///< each rank does its share of every batch; null: this process does all
  std::string instruction_set;  ///< empty: the best one of this processor

  // options of LibTorch only
  bool layer_norm = false;  ///< layer norm before hidden activations, in all networks
  /// Weight decay of AdamW; largest norm of a gradient (0: none), where the critics have one joint norm.
  double weight_decay = 0, gradient_clip = 0;
  std::string device = "cpu";  ///< or "cuda"
};

/// Throws std::invalid_argument for invalid options.
void check_options(const LearnerOptions& options);

/// An initial weight, uniform within +-scale/sqrt(inputs), as in torch's nn.Linear; biases are 0. `number`: index of
/// the weight, output by output. `network`: 0 for the actor, then the critics.
double first_weight(std::uint64_t seed, int network, int layer, int inputs, std::uint32_t number, double scale);

/// Work for an update's threads: run(0) to run(items - 1), each once, in any order, in parallel. run() must not throw
/// or change anything that the update reads.
struct ParallelWork {
  std::size_t items = 0;
  std::function<void(std::size_t)> run;
};

/// Metrics of the last update, summed in a fixed order.
struct UpdateMetrics {
  double critic_loss = 0;  ///< mean over critics and batch; not finite if learning diverged
  double mean_q = 0;       ///< mean of Q_1(s, a)
  double actor_q = 0;      ///< mean of Q_1(s, mu(s)) in the last update in which the actor learnt
};

/// Counters of a learner. Powers of beta are running products; they are saved, so that a resumed run has the same bits.
struct LearnerCounters {
  std::uint64_t updates = 0;
  double critic_beta1 = 1, critic_beta2 = 1, actor_beta1 = 1, actor_beta2 = 1;
};

template <class T>
class Learner {
 public:
  /// Throws std::invalid_argument for invalid options, or for an instruction set that this processor does not have.
  explicit Learner(const LearnerOptions& options);
  ~Learner();
  Learner(Learner&&) noexcept;
  Learner& operator=(Learner&&) noexcept;

  /// One step of Adam; its threads also do the work `beside`. Allocates no memory. Throws std::invalid_argument if
  /// `replay` is empty or has another shape.
  void update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside = {});

  const LearnerOptions& options() const;
  const UpdateMetrics& metrics() const;

  /// The present actor, without task and names of inputs and outputs.
  policy::Actor actor() const;
  /// Replaces the weights of the actor and of its target. Throws std::invalid_argument if the shape is another.
  void set_actor(const policy::Actor& actor);
  /// Actions for `count` observations, [count][observations] to [count][actions]; the same bits as policy::evaluate().
  void act(const float* observations, std::size_t count, T* actions) const;

  /// State for checkpoints, together with the counters: weights, targets and Adam's moments of critics and actor.
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
