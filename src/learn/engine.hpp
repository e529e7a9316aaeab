// Interface of the learner, with two implementations: our own lanes (learn/lanes), and LibTorch (learn/torch, a plugin that is loaded
// on demand, because LibTorch takes half a second to start). Both implement the algorithm of learner.hpp with the same options, initial
// weights, samples and noise; their results differ only by rounding.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "learn/lanes/learner.hpp"

namespace flappy::learn {

enum class EngineKind { lanes, libtorch };

class LearnerEngine {
 public:
  virtual ~LearnerEngine() = default;

  /// One gradient step at the given learning rates of Adam. The update's threads also do the work `beside`. Throws
  /// std::invalid_argument if `replay` is empty or has another shape.
  virtual void update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside) = 0;
  virtual const UpdateMetrics& metrics() const = 0;

  /// The present actor, without task and names of inputs and outputs.
  virtual policy::Actor actor() const = 0;
  /// Replaces the weights of the actor and of its target. Throws std::invalid_argument if the shape is another.
  virtual void set_actor(const policy::Actor& actor) = 0;
  /// Actions for `count` observations: [count][observations] to [count][actions].
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;

  /// State for checkpoints: the numbers of the networks (save, load) and the counters. An engine can load only numbers
  /// that the same kind of engine saved. load() throws std::invalid_argument if their count is wrong or one of them is
  /// not finite.
  virtual std::vector<float> save() const = 0;
  virtual void load(std::span<const float> numbers) = 0;
  virtual LearnerCounters& counters() = 0;
  const LearnerCounters& counters() const { return const_cast<LearnerEngine*>(this)->counters(); }

  /// Description for run.json: the kind of engine, and versions on which its bits depend.
  virtual std::string describe() const = 0;
};

/// Throws std::invalid_argument as Learner's constructor does, and io::InputError for EngineKind::libtorch in a build
/// without LibTorch.
std::unique_ptr<LearnerEngine> make_engine(EngineKind kind, const LearnerOptions& options);
/// Whether this build has the LibTorch plugin.
bool has_libtorch();

}  // namespace flappy::learn
