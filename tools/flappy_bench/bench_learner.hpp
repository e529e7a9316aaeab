// Updates per second of the learner, compared with LibTorch.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "learn/lanes/learner.hpp"
#include "speed.hpp"

namespace flappy::bench {

struct LearnerRow {
  std::string name;
  learn::LearnerOptions options;
  double multiply_adds = 0;            ///< multiply-adds of an update, without padding
  Figure updates_per_s;                ///< one core
  std::optional<Figure> torch_per_s;   ///< one core, the same update in plain LibTorch
  std::optional<Figure> times_torch;   ///< updates_per_s over torch_per_s, pair by pair
  std::optional<Figure> engine_share;  ///< updates of our LibTorch engine over those of plain LibTorch, pair by pair
  Figure two_thread_scaling;           ///< speed-up of wall time, pair by pair
};

/// A replay memory of random numbers, of the size that learner_options() expects.
learn::Replay random_replay();
/// `critic`: hidden widths. `td3`: twin critics, delayed policy and target noise; otherwise DDPG.
learn::LearnerOptions learner_options(std::vector<int> critic, std::size_t batch, bool td3);

/// `progress(done, total)` is called between measurements.
std::vector<LearnerRow> measure_learner(const SpeedOptions& options, const std::function<void(int, int)>& progress);

}  // namespace flappy::bench
