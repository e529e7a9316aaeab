// Flight logs of a vehicle in our own simulator, kept in memory, for predictions.
#pragma once

#include <optional>
#include <vector>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

struct SimulatedFlight {
  std::optional<flightlog::FlightLog> log;  ///< from `from_s` on; empty if the flight was too short
  bool lost = false;                        ///< frozen, tipped over, or far from its path while it was logged
};

/// Flies `vehicle` `copies` times on one thread, each with other noise. The vehicle and randomisation of `given` are
/// not used. Before `from_s`, flights are neither logged nor judged.
std::vector<SimulatedFlight> simulate(const FlyConfig& given, const model::Vehicle& vehicle, std::size_t copies,
                                      double from_s = 0);

}  // namespace flappy::rollout
