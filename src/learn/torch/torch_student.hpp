// Learning by imitation in LibTorch, through time, for networks with a memory; in the plugin of torch_learner.hpp.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "policy/actor_file.hpp"

namespace flappy::learn {

/// Whole flights with what should have been done: [action][flight][number].
struct Lessons {
  std::size_t actions = 0, flights = 0;
  std::vector<float> observation, wanted;  ///< `wanted`: in [-1, 1]
  std::vector<float> counts;               ///< [action][flight]: 1 while the flight goes on, else 0
};

class TorchStudent {
 public:
  virtual ~TorchStudent() = default;

  /// One step of Adam (Kingma and Ba 2015) on the mean square of what is done less what is wanted, over the elements of
  /// all actions that count; the memory is 0 before each flight. Returns that mean.
  virtual double learn(const Lessons& lessons, double rate) = 0;
  /// Weights in the order of policy::ActorView.
  virtual std::vector<double> weights() const = 0;
};

}  // namespace flappy::learn
