#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lab/blind/a/robot_controller.hpp"
#include "lab/blind/a/robot_sensors.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind {

struct Case {
  model::Vehicle vehicle;  ///< the robot's true parameters, without effects
  double declared_density_kg_m3 = 0;
  std::string vehicle_file, vehicle_sha256;  ///< declared in the log
  Magnitudes magnitudes;
  std::uint64_t seed = 0;
  std::size_t session = 0;
  std::optional<std::size_t> programme_of;  ///< session whose programme is flown; none: `session`
  PilotGains gains;
  Programme programme = Programme::rich;
  bool power = false, wings = false;
  double battery_V = kBattery_V;             ///< when full
  std::optional<SensorSet> sensors;          ///< if absent, drawn from the seed (sensors_of)
  const ProposedFlight* proposed = nullptr;  ///< replaces the programme; null: none
  model::Changes changes;                    ///< made by change_on_purpose(); declared in the log
};

/// Number of a flight in random streams (stream_of()): other numbers in each session. `flight` is below a million.
inline std::uint64_t flight_number(std::size_t session, std::size_t flight) { return 1'000'000 * session + flight; }

struct RobotFlight {
  bool crashed = false;
  std::string how;  ///< how and when it crashed; empty if it did not
  flightlog::FlightLog log;
  /// True state at the control rate, SI units: time, position, attitude (w first), velocity, body rates, stroke and
  /// rotation of the left and of the right wing, their rates, constant bias of the gyro.
  std::vector<flightlog::Column> truth;
  double farthest_m = 0, most_tilt_rad = 0;  ///< largest distance from the target, largest tilt of the body's z axis
};

Room flight_room();

/// The robot as it starts a flight.
Robot robot_of(const Case& c, std::size_t flight);

/// Called before each step, trimming included, with the commanded voltages (left, right).
using Watch = std::function<void(const Robot& robot, const std::array<double, 2>& volts)>;

/// Flies flight 0, 1, 2 or the proposed one: the robot trims, then the log begins. Equal arguments give equal bytes.
RobotFlight fly(const Case& c, std::size_t flight, const Watch& watch = {});

/// Pilot, asked each control period from kTrim_s before the log. `t_s`: the log's clock. `beat`: its fraction in [0,
/// 1).
using Steer = std::function<Inputs(double t_s, double beat, const Torso& torso)>;

/// Flies for `duration_s` from `start` on. The robot has crashed when it touches a surface, flies away, or the world z
/// of its z axis falls below `least_upright`.
RobotFlight fly(const Case& c, std::size_t flight, const Torso& start, double duration_s, double least_upright,
                const Steer& steer, const Watch& watch = {});

/// Flies under a firmware, without trimming.
RobotFlight fly_on_board(const Case& c, std::size_t flight, const Torso& start, double duration_s, OnBoard& firmware);

}  // namespace flappy::blind
