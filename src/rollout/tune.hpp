// Tuning of a controller: evolution strategy (CMA-ES) over the logarithm of its gains, judged on many flights at once.
//
//   schema = 1
//   vary = ["attitude.roll.p", ...]       gains, as in the controller's file; each starts above 0
//   duration_s, settle_s, seed, population, generations
//   [[trial]]                             flights that judge; the controller of the first trial is where the search starts
//   fly = "file"                          a configuration of flappy-fly
//   count, weight
#pragma once

#include <functional>

#include "io/ranks.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::rollout {

struct Trial {
  FlyConfig fly;
  std::size_t count;
  double weight;
};

struct TuneConfig {
  std::vector<std::string> vary;
  std::vector<Trial> trials;
  double duration_s, settle_s;
  std::uint64_t seed;
  unsigned population, generations;
  flight::Controller start;
  io::Ranks* ranks = nullptr;  ///< fly their shares of the flights of each trial
};

/// io::InputError for whatever is missing, unknown or out of range.
TuneConfig read_tune_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Mean cost of a flight, over trials by weight. A flight that strays 0.3 m from its path costs 3 to 4, the earlier the
/// more; another one (largest distance / 0.3 m)^2 plus, once settled, the mean square of its errors over 5 deg of roll and
/// of pitch, 10 deg of yaw (this term at most 1) and 5 cm.
double cost_of(const TuneConfig& config, const flight::Controller& controller);

struct TuneResult {
  flight::Controller best;
  double cost = 0;
  unsigned generations = 0;
};

/// `progress` after each generation; false ends the search.
TuneResult tune(const TuneConfig& config, const std::function<bool(const TuneResult&)>& progress);

}  // namespace flappy::rollout
