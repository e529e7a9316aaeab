// Speed of the closed loop: physics, sensors, estimator, controller, reward and observation of every flapper.
#pragma once

#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flight/fleet.hpp"
#include "speed.hpp"

namespace flappy::bench {

struct LoopRow {
  std::string name;
  Figure control_steps_per_s;
};

struct LoopReport {
  std::vector<LoopRow> rows;                           ///< the first is the reported one
  std::vector<std::pair<std::string, double>> shares;  ///< share of each stage in the time of the first row
  std::size_t bytes_per_flapper = 0;                   ///< memory in addition to the body's state
};

/// Options of a fleet that hovers with the sensors, task and controller of `configs`, on one thread.
flight::FleetOptions hovering(const std::string& configs, const std::string& sensors, const std::string& controller);

/// Measures hovering flappers with the sensors, task and controllers of `configs`, on one core, in float.
LoopReport measure_closed_loop(const model::Vehicle& vehicle, const std::string& configs, const SpeedOptions& options);

}  // namespace flappy::bench
