// A flight of a vehicle in our own simulator, as its sensors would have logged it: in memory, for predictions.
#pragma once

#include <optional>
#include <vector>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

struct SimulatedFlight {
  std::optional<flightlog::FlightLog> log;  ///< from where it was to be logged; nothing of a flight that was too short
  bool lost = false;                        ///< came apart, tipped over, or strayed from its path while it was logged
};

/// Flies `vehicle` `copies` times on one thread, each with noise of its own, as `given` says (its own vehicle and
/// randomisation are not used): path, controller or actor, sensors, excitation, duration. What comes before `from_s` is not
/// logged, nor is a flight judged there.
std::vector<SimulatedFlight> simulate(const FlyConfig& given, const model::Vehicle& vehicle, std::size_t copies,
                                      double from_s = 0);

}  // namespace flappy::rollout
