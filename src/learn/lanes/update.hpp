// The parts of an update that are compiled once for each instruction set.
#pragma once

#include "learn/lanes/network.hpp"

namespace flappy::learn {

/// Inputs of the networks: columns of a transition for the observation and the next one, and their normaliser as in
/// policy::ActorView.
template <class T>
struct InputView {
  int count = 0;
  std::ptrdiff_t now = 0, next = 0;  // first columns of observation and next observation
  const T *mean = nullptr, *scale = nullptr;
  T clip = 0;
};

/// Parameters that all chunks of an update share.
template <class T>
struct UpdatePlan {
  NetworkShape actor, critic;
  int critics = 1;
  const T *weights = nullptr, *targets = nullptr;  // [weight]: critics, then actor
  InputView<T> input;
  std::ptrdiff_t action = 0, reward = 0, discount = 0, row = 0;  // columns of a transition, and their number
  T noise_sd = 0, noise_clip = 0, huber = 0;
  T critic_share = 0, actor_share = 0;  // weight of one sample in the gradients of the losses
  std::uint64_t seed = 0;
  std::uint32_t update = 0;
  bool actor_learns = false;

  FLAPPY_INLINE std::ptrdiff_t actor_at() const { return critics * critic.weight_count(); }
  FLAPPY_INLINE std::ptrdiff_t weight_count() const { return actor_at() + actor.weight_count(); }
};

/// Sums over the samples of one chunk.
template <class T>
struct ChunkSums {
  T loss = 0, q = 0, actor_q = 0;
};

inline namespace FLAPPY_ISA {

/// Work memory of one thread: count() numbers.
template <class T>
struct Workspace {
  T* gathered;        // [kChunk][row]: transitions
  T* columns;         // [row][kChunk]: the transitions, transposed
  T *actor, *critic;  // values of the neurons
  T *target, *q;      // [kChunk]
  ActivationGradients<T> gradients;

  static std::ptrdiff_t row(const UpdatePlan<T>& plan) { return (plan.row + 15) / 16 * 16; }
  static std::ptrdiff_t widest(const UpdatePlan<T>& plan) {
    return plan.actor.widest() > plan.critic.widest() ? plan.actor.widest() : plan.critic.widest();
  }
  static std::ptrdiff_t count(const UpdatePlan<T>& plan) {
    return kRow * (2 * row(plan) + 3 * widest(plan) + 2) + plan.actor.value_count() + plan.critic.value_count();
  }
  Workspace(const UpdatePlan<T>& plan, T* at) {
    gathered = at, at += kRow * row(plan);
    columns = at, at += kRow * row(plan);
    actor = at, at += plan.actor.value_count();
    critic = at, at += plan.critic.value_count();
    target = at, at += kRow;
    q = at, at += kRow;
    gradients.now = at, at += kRow * widest(plan);
    gradients.next = at, at += kRow * widest(plan);
    gradients.transposed = at;
  }
};

}  // namespace FLAPPY_ISA

/// A step of Adam for a range of weights: sums the parts of their gradients in order, steps, and moves the targets.
template <class T>
struct AdamPlan {
  T *weights, *targets, *first, *second;
  const T* gradients;
  std::ptrdiff_t parts, part_size;
  T beta1, beta2, epsilon;
  T rate;         // learning rate / (1 - beta1^t)
  T second_root;  // 1 / sqrt(1 - beta2^t)
  T tau;          // 0: targets stay
};

template <class T>
struct UpdateKernel {
  /// Writes the gradients of kChunk samples to `gradient`, or adds them if `accumulate`. `rows`: rows of their
  /// transitions in `memory`. `sample`: number of the first sample in the batch.
  ChunkSums<T> (*chunk)(const UpdatePlan<T>&, T* work, const float* memory, const std::uint32_t* rows,
                        std::uint32_t sample, T* gradient, bool accumulate);
  /// A step of Adam for weights `begin` to `end` - 1; both are multiples of 16.
  void (*adam)(const AdamPlan<T>&, std::ptrdiff_t begin, std::ptrdiff_t end);
  /// Actions for kChunk observations: [kChunk][observations] to [kChunk][actions].
  void (*act)(const UpdatePlan<T>&, T* work, const float* observations, T* actions);
};

}  // namespace flappy::learn
