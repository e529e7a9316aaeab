// Replays a flight: what reached the robot's processor goes through the exported C, and its voltages come out.
#pragma once

#include <cstdint>
#include <vector>

#include "deploy/flown/onboard_log.hpp"
#include "deploy/flown/wiring.hpp"

namespace flappy::deploy {

struct Replay {
  std::vector<std::array<double, 2>> volts;       ///< left, right, for each command of the log up to `until_s`
  std::vector<OnboardLog::Inference> inferences;  ///< if the log has policy_numbers
};

/// `until_s`: commands later than this are left out. Not thread-safe: changes the constants of `c` while it runs.
Replay replay(const ExportedC& c, const Contract& contract, const OnboardLog& log, const Wiring& wiring,
              double until_s = std::numeric_limits<double>::infinity());

}  // namespace flappy::deploy
