// What learns, behind one interface: in our own lanes (learn/lanes), or on LibTorch (learn/torch, a plugin that is opened on demand,
// as LibTorch takes half a second to start). Both do what learner.hpp says by the same options, from the same first weights, on the
// same samples with the same noise; they differ by rounding alone.
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

  /// One gradient step, at the given rates of Adam. std::invalid_argument where `replay` is empty or has another shape.
  virtual void update(const Replay& replay, double actor_rate, double critic_rate, const Companion& beside) = 0;
  virtual const UpdateMetrics& metrics() const = 0;

  /// The actor as it is; task and names of inputs and outputs are left to the caller.
  virtual policy::Actor actor() const = 0;
  /// Starts from this actor instead: weights and target's. std::invalid_argument where its shape is another.
  virtual void set_actor(const policy::Actor& actor) = 0;
  /// Actions of `count` observations, row by row.
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;

  /// All that updates change, for checkpoints: numbers of the networks, and what is counted. An engine loads what it saved itself;
  /// std::invalid_argument for as many numbers as it has not, or where one is not finite.
  virtual std::vector<float> save() const = 0;
  virtual void load(std::span<const float> numbers) = 0;
  virtual LearnerCounters& counters() = 0;
  const LearnerCounters& counters() const { return const_cast<LearnerEngine*>(this)->counters(); }

  /// What it is and what its bytes depend on, for run.json.
  virtual std::string describe() const = 0;
};

/// std::invalid_argument as Learner has it; io::InputError in a build without LibTorch where that is asked for.
std::unique_ptr<LearnerEngine> make_engine(EngineKind kind, const LearnerOptions& options);
/// Whether this build has LibTorch's plugin.
bool has_libtorch();

}  // namespace flappy::learn
