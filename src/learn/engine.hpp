// Interface of the learner, implemented by our lanes (learn/lanes) and by LibTorch (learn/torch, a plugin loaded on
// demand, because LibTorch takes half a second to start). Both run learner.hpp's algorithm with the same options,
// initial weights, samples and noise; results differ only by rounding.
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

  /// One step of Adam; its threads also do the work `beside`. Throws std::invalid_argument if `replay` is empty or has
  /// another shape.
  virtual void update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside) = 0;
  virtual const UpdateMetrics& metrics() const = 0;

  /// The present actor, without task and names of inputs and outputs.
  virtual policy::Actor actor() const = 0;
  /// Replaces the weights of the actor and of its target. Throws std::invalid_argument if the shape is another.
  virtual void set_actor(const policy::Actor& actor) = 0;
  /// Actions for `count` observations: [count][observations] to [count][actions].
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;

  /// State for checkpoints: the networks' numbers and the counters. An engine loads only numbers that its kind saved.
  /// load() throws std::invalid_argument for a wrong count or a number that is not finite.
  virtual std::vector<float> save() const = 0;
  virtual void load(std::span<const float> numbers) = 0;
  virtual LearnerCounters& counters() = 0;
  const LearnerCounters& counters() const { return const_cast<LearnerEngine*>(this)->counters(); }

  /// Description for run.json: the kind of engine, and versions on which its bits depend.
  virtual std::string describe() const = 0;
};

/// Throws std::invalid_argument as Learner does; io::InputError for libtorch in a build without LibTorch.
std::unique_ptr<LearnerEngine> make_engine(EngineKind kind, const LearnerOptions& options);
bool has_libtorch();

}  // namespace flappy::learn
