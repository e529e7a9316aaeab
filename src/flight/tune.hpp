// Tuning of a controller: evolution strategy (CMA-ES) over the logarithm of its gains, on many randomised vehicles at once.
#pragma once

#include <functional>

#include "flight/fleet.hpp"
#include "sim/randomise.hpp"

namespace flappy::flight {

/// Flights that judge a controller: `count` different vehicles (or one with different noise), each for `duration_s`.
struct Trial {
  sim::Randomisation vehicles;
  std::size_t count;
  double weight;
};

struct TuneOptions {
  std::vector<std::string> vary;  ///< paths of the gains, as in the controller's file; each must be above 0
  std::vector<Trial> trials;
  double duration_s = 5, settled_from_s = 3;
  unsigned population = 20, generations = 60;
  unsigned seed = 1;
};

struct TuneReport {
  Controller best;
  double cost = 0;
  std::vector<double> values;  ///< of `vary`
};

/// Mean cost of a flight. One that strays 0.3 m from its path costs 3 to 4, the earlier the more; another (largest
/// distance / 0.3 m)^2 plus, once settled, the mean square of its errors over 5 deg of roll and pitch, 10 deg of yaw (at
/// most 1) and 5 cm of x, y and z.
double trial_cost(const FleetOptions& options, const Controller& controller, const TuneOptions& tune);

/// `progress(generation, cost, controller)` after each generation.
TuneReport tune(const FleetOptions& options, const TuneOptions& tune,
                const std::function<void(unsigned, double, const Controller&)>& progress);

}  // namespace flappy::flight
