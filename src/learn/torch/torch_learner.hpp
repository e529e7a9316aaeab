// The plugin with the LibTorch code of the engine on LibTorch.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "learn/lanes/learner.hpp"

namespace flappy::learn {

/// Networks and their update. Weights are in the order critics, then actor; in a network as in policy::ActorView.
class TorchLearner {
 public:
  enum class Kind { weights, targets, first_moments, second_moments };
  virtual ~TorchLearner() = default;

  /// A step of Adam: rate, and corrections of the moments, first = 1 / (1 - beta1^t), root = 1 / sqrt(1 - beta2^t).
  struct Step {
    double rate, first, root;
  };
  struct Batch {
    std::span<const std::uint32_t> rows;  ///< rows in the replay memory
    std::span<const float> noise;         ///< standard normals, [batch][actions]; empty: none
    bool actor_learns;
    Step actor, critic;
  };
  /// Computes the gradients for batch.rows, on the calling thread only. `share`: of these rows in the whole batch, by
  /// which gradients and metrics are multiplied.
  virtual UpdateMetrics differentiate(const Replay& replay, const Batch& batch, double share) = 0;
  /// Does the step of Adam after differentiate(). If the actor learns, it also moves the targets by tau to the weights.
  virtual void step(const Batch& batch) = 0;
  /// The gradients, count() numbers, for the exchange between ranks before step().
  virtual void get_gradients(std::span<float> numbers) const = 0;
  virtual void set_gradients(std::span<const float> numbers) = 0;
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;
  virtual std::size_t count() const = 0;  ///< number of weights of all networks
  virtual void get(Kind kind, std::span<double> numbers) const = 0;
  virtual void set(Kind kind, std::span<const double> numbers) = 0;
};

struct TorchLearnerFunctions {
  /// `twice`: double precision, for tests. Throws io::InputError for a device that LibTorch does not have.
  std::unique_ptr<TorchLearner> (*make)(const LearnerOptions& options, bool twice);
  std::string (*version)();  ///< versions of LibTorch and its BLAS, on which bits and speed depend
};
/// The functions of the plugin, which is loaded on the first call. Throws io::InputError in a build without LibTorch.
const TorchLearnerFunctions& torch_functions();

extern "C" const TorchLearnerFunctions flappy_torch_learner_functions;  ///< the only symbol that the plugin exports

}  // namespace flappy::learn
