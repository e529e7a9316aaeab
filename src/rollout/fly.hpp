// Flies a configuration many times over and says how well it went. Flights differ by the number of their flapper: noise,
// gyro bias, start, and the vehicle where it is randomised. What a flight does depends on nothing else, so they may be
// flown all at once or in parts.
#pragma once

#include <functional>

#include "rollout/flight_score.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::rollout {

struct FlyOptions {
  std::size_t count = 1;
  /// Where logs go: the folder itself is the log of a single flight, else it has one folder each, 0000 and on.
  std::filesystem::path log_folder;
  /// Where the log of a single flight goes as topics of ROS 2; empty: nowhere.
  std::filesystem::path mcap;
  /// Memory for logs: flights are flown in parts whose logs need no more, or one by one.
  double log_bytes = 512e6;
  /// Asked every control period, with the share that is done; false ends the flights where they are.
  std::function<bool(double done)> keep_going;
};

struct FlyResult {
  FlightSummary summary;
  bool stopped = false;
  double flown_s = 0;                  ///< by each flight; where stopped, by the last ones
  std::array<std::size_t, 6> ended{};  ///< flights whose task ended by each bit of Ended; they fly on
  std::size_t handed_back = 0;
  std::vector<double> capture_s;  ///< when each flight that captured its goal did so
  std::size_t successes = 0;      ///< captured it, kept it as the task asks, and did not crash
  std::size_t logs = 0;
  bool mcap = false;       ///< whether it was long enough for one
  std::uint64_t hash = 0;  ///< of how each vehicle moves, at the end, in order
  double wall_s = 0, scoring_s = 0, steps = 0;
};

/// io::InputError where a log cannot be written.
FlyResult fly(const FlyConfig& config, const FlyOptions& options);

}  // namespace flappy::rollout
