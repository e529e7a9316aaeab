// The learner's update as a plain LibTorch loop: the reference of the tests, and the peer of the benchmark.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "learn/lanes/learner.hpp"

namespace flappy::reference {

class TorchLearner {
 public:
  enum class Network { critic_1, critic_2, actor };
  /// Numbers of a network: for each layer, for every output its bias, then one for each input.
  using Numbers = std::vector<double>;
  template <class T>
  static Numbers numbers(const learn::Learner<T>& learner, Network network, typename learn::Learner<T>::Kind kind) {
    Numbers list;
    for (const auto& layer : learner.layers(static_cast<typename learn::Learner<T>::Network>(network), kind)) {
      const auto row = static_cast<std::size_t>(layer.padded), inputs = static_cast<std::size_t>(layer.inputs);
      for (std::size_t o = 0; o < static_cast<std::size_t>(layer.outputs); ++o)
        for (std::size_t i = 0; i <= inputs; ++i) list.push_back(layer.numbers[i * row + o]);
    }
    return list;
  }
  /// Weights of all three networks; without twins, those of the second critic mean nothing.
  template <class T>
  static std::array<Numbers, 3> start(const learn::Learner<T>& learner) {
    const auto of = [&](Network n) { return numbers(learner, n, learn::Learner<T>::Kind::weights); };
    return {of(Network::critic_1), of(learner.options().twin ? Network::critic_2 : Network::critic_1),
            of(Network::actor)};
  }

  /// All in double or all in float. `start`: as start() has it.
  TorchLearner(const learn::LearnerOptions& options, const learn::Replay& replay, bool twice,
               const std::array<Numbers, 3>& start);
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

}  // namespace flappy::reference
