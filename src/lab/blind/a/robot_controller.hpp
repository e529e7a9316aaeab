// The pilot: the project's cascaded PID follows waypoints on an imperfect view; excitation is added to its inputs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

enum class Programme { rich, hover, calm };
inline constexpr std::size_t kFlights = 3;
inline constexpr double kFlight_s = 10, kTrim_s = 5, kControl_s = 2e-3;

struct Inputs {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

Inputs clipped(const Inputs& u, const model::Driver& d);

struct Waypoint {
  double t_s = 0;
  Vector3d position_m = Vector3d::Zero();
  double heading_rad = 0;
};

struct Aim {
  Vector3d position_m, velocity_m_s, acceleration_m_s2;
  double heading_rad, heading_rad_s;
};

/// Target and excitation of a flight, on the clock of its log; before t = 0 the target is the first waypoint.
class Plan {
 public:
  /// `number`: the flight's in random streams (flight_number).
  Plan(Programme programme, std::size_t flight, const Room& room, std::uint64_t seed, std::uint64_t number);
  Aim at(double t_s) const;
  /// Inputs that are added to the controller's output; none before t = 0.
  Inputs excitation(double t_s) const;
  const Waypoint& start() const { return waypoints_.front(); }

 private:
  struct Sine {
    int input;
    double amplitude, Hz, phase_turns;
  };
  struct Step {
    int input;
    double begin_s, end_s, height;
  };
  std::vector<Waypoint> waypoints_;
  std::vector<Sine> sines_;
  std::vector<Step> steps_;
};

class RobotController {
 public:
  RobotController(const model::Driver& driver, std::uint64_t seed, std::uint64_t flight);
  ~RobotController();
  Inputs steer(const Torso& torso, const Aim& aim, const Inputs& excitation);
  /// Voltage of one motor at the fraction `beat` of the beat, in [0, 1).
  static double voltage(const Inputs& inputs, std::size_t side, double beat, double limit_V);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flappy::blind
