// Tuning of a controller: CMA-ES over the logarithms of its gains; the cost is the mean over many flights.
//   schema = 1
//   vary = ["attitude.roll.p", ...]       gains, as in the controller's file; each starts above 0
//   duration_s, settle_s, seed, population, generations
//   [[trial]]                             flights that give the cost; the first one's controller starts the search
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
  io::Ranks* ranks = nullptr;  ///< each rank flies its share of every trial's flights
};

/// Throws io::InputError for anything that is missing, unknown or out of range.
TuneConfig read_tune_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Mean cost of a flight, weighted over trials. Straying 0.3 m from the path costs 3 to 4, more if earlier. Else
/// (largest distance / 0.3 m)^2 plus, after settle_s, the mean of (roll / 5 deg)^2 + (pitch / 5 deg)^2 + (distance / 5
/// cm)^2 plus that of (yaw / 10 deg)^2, the latter at most 1; errors from the set point.
double cost_of(const TuneConfig& config, const flight::Controller& controller);

struct TuneResult {
  flight::Controller best;
  double cost = 0;
  unsigned generations = 0;
};

/// Calls `progress` after each generation with the best so far; false stops. Gains stay within e^+-3 of their start.
TuneResult tune(const TuneConfig& config, const std::function<bool(const TuneResult&)>& progress);

/// The file of a controller; `origin`: its first line, a comment.
std::string controller_text(flight::Controller controller, const std::string& origin);

}  // namespace flappy::rollout
