// The part of the engine on LibTorch that needs LibTorch: a plugin.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "learn/lanes/learner.hpp"

namespace flappy::learn {

/// Networks and their update. Numbers of a network: for each layer, for every output its bias, then one for each input; with layer
/// norm, after those of a hidden layer a gain for each output, then a shift for each. Of all: those of the critics, then the actor's.
class TorchLearner {
 public:
  enum class Kind { weights, targets, first_moments, second_moments };
  virtual ~TorchLearner() = default;

  /// A step of Adam: its rate, and what corrects the moments: 1 / (1 - power of beta1), 1 / sqrt(1 - power of beta2).
  struct Step {
    double rate, first, root;
  };
  struct Batch {
    std::span<const std::uint32_t> rows;  ///< of the replay memory
    std::span<const float> noise;         ///< standard normals, [batch][actions]; empty: none
    bool actor_learns;
    Step actor, critic;
  };
  /// The gradients of `rows`, which are this share of the batch, on the thread that calls, alone; its share of the metrics.
  virtual UpdateMetrics differentiate(const Replay& replay, const Batch& batch, double share) = 0;
  /// The step that follows.
  virtual void step(const Batch& batch) = 0;
  /// The gradients in between, for ranks: as many as count().
  virtual void get_gradients(std::span<float> numbers) const = 0;
  virtual void set_gradients(std::span<const float> numbers) = 0;
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;
  virtual std::size_t count() const = 0;  ///< of numbers of a kind
  virtual void get(Kind kind, std::span<double> numbers) const = 0;
  virtual void set(Kind kind, std::span<const double> numbers) = 0;
};

/// What the plugin does.
struct TorchLearnerFunctions {
  /// `twice`: in double, for tests. io::InputError for a device that LibTorch has not.
  std::unique_ptr<TorchLearner> (*make)(const LearnerOptions& options, bool twice);
  std::string (*version)();  ///< LibTorch's, and its BLAS, on which bytes and speed depend
};
/// Those of the plugin, which is opened when they are first asked for. io::InputError in a build without LibTorch.
const TorchLearnerFunctions& torch_functions();

extern "C" const TorchLearnerFunctions flappy_torch_learner_functions;  ///< all that the plugin exports

}  // namespace flappy::learn
