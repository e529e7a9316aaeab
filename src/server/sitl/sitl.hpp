// The simulator as the robot of an autopilot: it publishes what the sensors say and flies by the inputs that come back.
//
//   /flappy/imu, pose, joint_states, battery   flapper_topics.hpp; poses are those of motion capture, stamps when a sample was taken
//   /flappy/tick                               Tick, after them: so many samples have arrived by this control period
//   /clock                                     time of the flight
//   /flappy/wing_input                         WingInput, taken: the inputs of the wing beat for the period of its tick
//
// In lock step a period is flown when its input has come, and the flight is the same bytes whatever the computer does. In real time
// a period lasts as long as it does on the robot: an input that has not come by its end is missed, and the last one holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "rollout/fly_config.hpp"

namespace flappy::server {

struct SitlOptions {
  bool lock_step = true;
  double timeout_s = 10;                        ///< without an autopilot, or in lock step without its input
  double manoeuvre_s = -1;                      ///< when the pilot wishes for the manoeuvre; negative: never
  std::filesystem::path log_folder;             ///< empty: no log
  std::function<bool(double done)> keep_going;  ///< asked every period
};

struct SitlResult {
  std::uint64_t periods = 0, missed = 0;
  std::uint64_t refused = 0;  ///< inputs that are no finite numbers
  std::uint64_t stray = 0;    ///< inputs for another period than the one that waits
  double round_trip_median_s = 0, round_trip_p99_s = 0, round_trip_most_s = 0;  ///< from a tick to its input
  bool crashed = false, stopped = false, logged = false;
  std::uint64_t hash = 0;  ///< of how the vehicle moves at the end
};

/// io::InputError where no autopilot comes, or in lock step none answers.
SitlResult fly_sitl(const rollout::FlyConfig& config, const SitlOptions& options);

}  // namespace flappy::server
