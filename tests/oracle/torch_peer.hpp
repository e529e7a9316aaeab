// The learner's update as a plain LibTorch loop: the oracle of the tests, and the peer of the benchmark.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "learn/learner.hpp"

namespace flappy::oracle {

class TorchLearner {
 public:
  enum class Network { critic_1, critic_2, actor };
  /// Numbers of a network: for each layer, for every output its bias, then one for each input.
  using Numbers = std::vector<double>;

  /// All in double or all in float. `start`: weights of critic_1, critic_2 and the actor.
  TorchLearner(const learn::LearnerOptions& options, const learn::Replay& replay, bool twice,
               const Numbers (&start)[3]);
  ~TorchLearner();

  /// One update on these transitions. `noise`: standard normals, [batch][actions]; where it is empty, LibTorch draws them.
  void update(std::span<const std::uint32_t> rows, std::span<const double> noise, double actor_rate,
              double critic_rate);

  Numbers weights(Network network) const;
  Numbers targets(Network network) const;
  Numbers gradients(Network network) const;  ///< of the last update
  double critic_loss() const;

  /// LibTorch's version and its BLAS, on which its speed hangs; from the first call on it works with one thread.
  static std::string version();

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace flappy::oracle
