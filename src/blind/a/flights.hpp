// Whole flights of the blind robot, as logs.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "blind/a/robot_controller.hpp"
#include "blind/a/robot_sensors.hpp"
#include "blind/family.hpp"

namespace flappy::blind {

/// One robot and what it flies.
struct Case {
  model::Vehicle vehicle;  ///< the robot's own, effects left out
  double declared_density_kg_m3 = 0;
  std::string vehicle_file, vehicle_sha256;  ///< as declared in the log
  Sizes sizes;
  std::uint64_t seed = 0;
  Programme programme = Programme::rich;
  bool power = false, wings = false;
  std::optional<SensorSet> sensors;          ///< where they are not those of the seed
  const ProposedFlight* proposed = nullptr;  ///< in place of a programme
};

struct RobotFlight {
  bool crashed = false;
  std::string how;  ///< it crashed
  flightlog::FlightLog log;
  /// At the control rate: time, position, attitude (w first), velocity, body rates, stroke and rotation of both wings, their rates,
  /// the gyro's constant bias.
  std::vector<flightlog::Column> truth;
  double farthest_m = 0, most_tilt_rad = 0;  ///< from where it was meant to be; of the body's z axis
};

/// The room in which they fly.
Room flight_room();

/// Sees the robot before each step, from the first of the trimming on, and the volts of the step.
using Watch = std::function<void(const Robot& robot, const std::array<double, 2>& volts)>;

/// Flight 0, 1 or 2 of a case: it learns to trim, then the log begins. The same bytes for the same case.
RobotFlight fly(const Case& c, std::size_t flight, const Watch& watch = {});

/// Who steers: asked once each control period, from kTrim_s before the log begins; `t_s` is on the log's clock, `beat` the
/// fraction of the beat in [0, 1).
using Steer = std::function<Inputs(double t_s, double beat, const Torso& torso)>;

/// A flight of `duration_s` from `start` on. It has crashed where it touches something, flies away, or its z axis comes
/// below `least_upright` over the level (sine of the angle).
RobotFlight fly(const Case& c, std::size_t flight, const Torso& start, double duration_s, double least_upright,
                const Steer& steer, const Watch& watch = {});

}  // namespace flappy::blind
