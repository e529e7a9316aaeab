// Families of blind robots: robots of one making each. They share this header and nothing else: no physics, no law of an effect,
// no sensor, no convention, no controller. tests/structure checks it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::blind {

/// What may be wrong with a family's robots.
struct FamilyEffect {
  std::string id;       ///< that of the catalogue's entry with this cause; outside_* where it has none
  std::string typical;  ///< what size 1 is, in words and units
  /// What is sealed with a case: in which channels it acts (force_x .. torque_z of B, gyro, accelerometer, mocap, current), and
  /// with what it grows ("always", or of height, ceiling, wall, place, amplitude, difference, bias, split_cycle, velocity, rate,
  /// acceleration, time, temperature, charge, stroke, heading).
  std::vector<std::string> channels, regimes;
};

/// A flight that somebody proposes, on the clock of its log.
struct ProposedFlight {
  double lasts_s = 0;
  std::function<std::array<double, 4>(double t_s)> goal;  ///< x, y, z in m and heading in rad, smooth
  std::function<std::array<double, 4>(double t_s)>
      excitation;  ///< to be added to the pilot's inputs: V, V, V, split cycle
};

/// One robot and what is wrong with it.
struct Assignment {
  std::filesystem::path vehicle_file;                   ///< as declared; a family reads it in its own way
  std::vector<std::pair<std::string, double>> effects;  ///< id, size: 1 is typical of a 12 g robot, at most 4
  std::uint64_t seed = 0;             ///< draws the robot, its sensors and what effects have of their own
  bool hover = false;                 ///< it hovers; else rich flights: places, speeds, inputs that are excited
  bool own_figures = false;           ///< each figure of each body is drawn apart; else they are those of the file
  bool conventions = false;           ///< declarations are drawn within what laboratories do; else they are exact
  bool power = false, wings = false;  ///< logs of currents, of strokes
  const ProposedFlight* proposed = nullptr;  ///< what it flies in place of hover and rich flights
};

struct FamilyFlight {
  bool crashed = false;
  std::string how;           ///< it crashed
  flightlog::FlightLog log;  ///< from t = 0 on
};

/// What an effect changes along a flight that was flown without it: for each wing beat of the log its start, then mean, cosine and
/// sine of the first and of the second harmonic of specific force at the IMU (m/s^2, x, y, z of B) and of turning acceleration
/// (rad/s^2); the torso moves as it was flown, everything else as the robot has it.
struct Contrast {
  std::vector<double> beat_s;
  std::vector<std::array<double, 30>> change;  ///< [channel x 5 + coefficient]
};

/// From an observation by name, in SI units, to what is added to the controller's output: V, V, V, split cycle.
using NamedPolicy = std::function<std::array<double, 4>(const std::vector<double>& observation)>;

/// The escape as the policy was trained for it: names as in a task file, numbers as there.
struct EscapeAssignment {
  std::vector<std::string> observation;
  NamedPolicy policy;
  double action_period_s = 0.01;
  std::array<double, 3> start_m{}, start_half_m{};  ///< from the goal, uniform within +-half
  double heading_rad = 0, heading_half_rad = 0, x_low_m = -1e9, x_high_m = 1e9;
  struct Bounds {
    double distance_m, speed_m_s, body_rate_rad_s, tilt_rad, heading_rad;
  } hand_back{}, capture{}, keep{};
  double hand_back_at_s = 0, capture_by_s = 0, keep_from_s = 0, keep_until_s = 0;
};

struct FamilyEscape {
  bool success = false, crashed = false;
  double captured_s = 0;  ///< 0: never
  flightlog::FlightLog log;
};

class Family {
 public:
  virtual ~Family() = default;
  virtual std::string name() const = 0;
  virtual const std::vector<FamilyEffect>& effects() const = 0;
  static constexpr std::size_t kFlights = 3;
  static constexpr double kFlight_s = 10;
  /// Flight 0, 1 or 2 of an assignment, or 3, the one that is proposed, after some seconds in which the robot finds its trim. The same bytes for the same arguments,
  /// on any number of threads, of any processor of one kind.
  virtual FamilyFlight fly(const Assignment& a, std::size_t flight) const = 0;
  virtual Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect, double size) const = 0;
  virtual FamilyEscape escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules) const = 0;
};

}  // namespace flappy::blind
