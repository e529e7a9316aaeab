// The parts of an update that are compiled once for each instruction set.
#pragma once

#include "learn/lanes/network.hpp"

namespace flappy::learn {

/// What networks see: columns of a transition now and next, normalised as flight::ActorView has it.
template <class T>
struct InputView {
  int count = 0;
  std::ptrdiff_t now = 0, next = 0;  // columns
  const T *mean = nullptr, *scale = nullptr;
  T clip = 0;
};

/// The same for all chunks of an update.
template <class T>
struct UpdatePlan {
  NetworkShape actor, critic;
  int critics = 1;
  const T *weights = nullptr, *targets = nullptr;  // of the critics, then of the actor
  InputView<T> input;
  std::ptrdiff_t action = 0, reward = 0, discount = 0, row = 0;  // columns of a transition, and how many
  T noise_sd = 0, noise_clip = 0, huber = 0;
  T critic_share = 0, actor_share = 0;  // weight of one sample in the gradients of the losses
  std::uint64_t seed = 0;
  std::uint32_t update = 0;
  bool actor_learns = false;

  FLAPPY_INLINE std::ptrdiff_t actor_at() const { return critics * critic.weight_count(); }
  FLAPPY_INLINE std::ptrdiff_t weight_count() const { return actor_at() + actor.weight_count(); }
};

/// Of one chunk.
template <class T>
struct ChunkSums {
  T loss = 0, q = 0, actor_q = 0;
};

inline namespace FLAPPY_ISA {

/// Where one thread works: as many numbers as count() says.
template <class T>
struct Workspace {
  T* gathered;        // [kChunk][row]: transitions
  T* columns;         // [row][kChunk]: the same, transposed
  T *actor, *critic;  // values of their neurons
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

/// Adam for a stretch of numbers: sums the parts of their gradients in order, steps, and moves the targets.
template <class T>
struct AdamPlan {
  T *weights, *targets, *first, *second;
  const T* gradients;
  std::ptrdiff_t parts, part_size;
  T beta1, beta2, epsilon;
  T rate;         // over 1 - beta1^t
  T second_root;  // 1 / sqrt(1 - beta2^t)
  T tau;          // 0: targets stay
};

template <class T>
struct UpdateKernel {
  /// Writes the gradients of kChunk samples to `gradient`, or adds them where it is to accumulate. `rows` are their transitions
  /// in `memory`, `sample` is the number of the first in the batch.
  ChunkSums<T> (*chunk)(const UpdatePlan<T>&, T* work, const float* memory, const std::uint32_t* rows,
                        std::uint32_t sample, T* gradient, bool accumulate);
  /// Numbers `begin` to `end`, multiples of 16.
  void (*adam)(const AdamPlan<T>&, std::ptrdiff_t begin, std::ptrdiff_t end);
  /// Actions of kChunk observations, row by row.
  void (*act)(const UpdatePlan<T>&, T* work, const float* observations, T* actions);
};

}  // namespace flappy::learn
