// The networks of TD3 and their update in LibTorch, in a plugin, so that programs start without LibTorch.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "learn/lanes/learner.hpp"
#include "learn/torch/torch_student.hpp"

namespace flappy::learn {

/// One or two critics and the actor of TD3, and their update, for one thread at a time. get() and set() use the order
/// critics, then actor; in a network that of policy::ActorView. Gradients have another order, the same on all ranks.
class TorchLearner {
 public:
  enum class Kind { weights, targets, first_moments, second_moments };
  virtual ~TorchLearner() = default;

  /// Step t = 1, 2, ... of Adam: learning rate, and the factors that remove the bias of the moments,
  /// first = 1 / (1 - beta1^t), root = 1 / sqrt(1 - beta2^t).
  struct Step {
    double rate, first, root;
  };
  struct Batch {
    std::span<const std::uint32_t> rows;  ///< rows in the replay memory
    std::span<const float> noise;  ///< standard normals, [row][action], to smooth the target actions; empty: none
    bool actor_learns;
    Step actor, critic;
  };
  /// Computes the gradients for batch.rows, on the calling thread only, and multiplies them and the metrics by `share`,
  /// which is the number of these rows over the number of rows in the whole batch of all ranks.
  virtual UpdateMetrics differentiate(const Replay& replay, const Batch& batch, double share) = 0;
  /// Does the step of Adam after differentiate(), with the limit of the gradient and the weight decay of
  /// LearnerOptions. If the actor learns, it also moves the target networks towards the weights, by the share
  /// LearnerOptions::tau.
  virtual void step(const Batch& batch) = 0;
  /// The gradients, count() numbers, for the exchange between ranks before step(). Those of the actor are 0 if it does
  /// not learn.
  virtual void get_gradients(std::span<float> numbers) const = 0;
  virtual void set_gradients(std::span<const float> numbers) = 0;
  /// Actions of the actor without noise, [count][action], from observations as the task gives them,
  /// [count][observation].
  virtual void act(const float* observations, std::size_t count, float* actions) const = 0;
  virtual std::size_t count() const = 0;  ///< number of weights of critics and actor together
  /// Copies count() numbers out or in. All are 0 after make(): set weights and targets before the first update.
  virtual void get(Kind kind, std::span<double> numbers) const = 0;
  virtual void set(Kind kind, std::span<const double> numbers) = 0;
};

std::unique_ptr<TorchStudent> make_torch_student(const policy::Actor& actor);

struct TorchLearnerFunctions {
  /// `twice`: compute in double precision, for tests. Throws io::InputError for a device that LibTorch does not have.
  std::unique_ptr<TorchLearner> (*make)(const LearnerOptions& options, bool twice);
  /// `actor`: its shape and first weights; hidden layers of relu or tanh, no layer norm.
  std::unique_ptr<TorchStudent> (*make_student)(const policy::Actor& actor);
  std::string (*version)();  ///< versions of LibTorch and its BLAS, on which the bits of results depend
};
/// The functions of the plugin, which is loaded on the first call. Throws io::InputError in a build without LibTorch.
const TorchLearnerFunctions& torch_functions();

extern "C" const TorchLearnerFunctions flappy_torch_learner_functions;  ///< the only symbol that the plugin exports

}  // namespace flappy::learn
