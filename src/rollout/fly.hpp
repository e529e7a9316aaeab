// Flies a configuration many times and summarises the flights. Noise, gyro bias, start and randomised vehicle of a
// flight depend only on the number of its flapper, so flights may be flown all at once or in parts.
#pragma once

#include <functional>

#include "rollout/flight_score.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::rollout {

struct FlyOptions {
  std::size_t count = 1;
  /// Folder for logs; empty: none. It is the log of a single flight; several flights get subfolders 0000, 0001, ...
  std::filesystem::path log_folder;
  /// File for the log of a single flight as topics of ROS 2; empty: no file.
  std::filesystem::path mcap;
  /// Memory for logs. It limits the number of flights that are flown at a time, which is at least one.
  double log_bytes = 512e6;
  /// Called every control period with the share that is done; false ends the flights there.
  std::function<bool(double done)> keep_going;
};

struct FlyResult {
  FlightSummary summary;
  bool stopped = false;
  double flown_s = 0;                  ///< duration of each flight; if stopped, of the flights flown last
  std::array<std::size_t, 6> ended{};  ///< number of flights whose task ended first by each bit of Ended; they fly on
  std::size_t handed_back = 0;
  std::vector<double> capture_s;  ///< capture times of the flights that captured their goal
  std::size_t successes = 0;      ///< flights that succeed (outcome.hpp)
  std::size_t logs = 0;
  bool mcap = false;       ///< whether the mcap file was written: the flight was long enough
  std::uint64_t hash = 0;  ///< hash of the final motion states of all vehicles, in order
  double wall_s = 0, scoring_s = 0, steps = 0;
};

/// Throws io::InputError if a log cannot be written.
FlyResult fly(const FlyConfig& config, const FlyOptions& options);

}  // namespace flappy::rollout
