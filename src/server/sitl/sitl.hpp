// Software in the loop: the simulator plays an autopilot's robot; it publishes samples and flies by the inputs it gets.
//
//   /flappy/imu, pose, joint_states, battery   flapper_topics.hpp; poses of motion capture, stamped by sampling time
//   /flappy/tick         Tick, after the samples: the number of samples that have arrived by this control period
//   /clock               flight time
//   /flappy/wing_input   WingInput, subscribed: inputs of the wing beat for the period of its tick
//
// In lock step, a period is flown once its input has arrived, so the flight is reproducible to the byte. In real time,
// an input that has not arrived by the end of its period is missed, and the last input holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "rollout/fly_config.hpp"

namespace flappy::server {

struct SitlOptions {
  bool lock_step = true;
  double timeout_s = 10;                        ///< limit for an autopilot to appear, and in lock step for each input
  double manoeuvre_s = -1;                      ///< when the pilot asks for the manoeuvre; negative: never
  std::filesystem::path log_folder;             ///< empty: no log
  std::function<bool(double done)> keep_going;  ///< called every period with the share flown; false stops the flight
};

struct SitlResult {
  std::uint64_t periods = 0, missed = 0;
  std::uint64_t refused = 0;  ///< inputs that are not finite
  std::uint64_t stray = 0;    ///< inputs for another period than the current one
  double round_trip_median_s = 0, round_trip_p99_s = 0, round_trip_most_s = 0;  ///< time from a tick to its input
  bool crashed = false, stopped = false, logged = false;
  std::uint64_t hash = 0;  ///< hash of the simulation's final state
};

/// Throws io::InputError where no autopilot appears, lock step misses an input, or the task sets motor voltages.
SitlResult fly_sitl(const rollout::FlyConfig& config, const SitlOptions& options);

}  // namespace flappy::server
