// A family of blind robots is one simulator, written apart, and its robots. Families share this header and no other code
// (tests/structure checks this), and no law or number of an effect (lab/benchmark/laws.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::blind {

struct FamilyEffect {
  std::string id;       ///< id of the catalogue's effect with this cause; outside_* if the catalogue has none
  std::string typical;  ///< the effect at magnitude 1, in words and units
  /// Sealed with a case: channels in which it acts (specific_force_x .. angular_acceleration_z in B, gyro, accelerometer,
  /// mocap, current), and quantities with which it grows ("always", height, ceiling, wall, place, amplitude, difference,
  /// bias, split_cycle, velocity, rate, acceleration, time, temperature, charge, stroke, heading).
  std::vector<std::string> channels, regimes;
  std::string law = {};     ///< its equation in words; empty: not written down yet
  std::string source = {};  ///< the literature that it follows; "choice": none
  /// Constants of the law at magnitude 1 that carry its strength and scales: positive, SI units.
  std::vector<double> numbers = {};
};

/// A flight that a diagnosis proposes, on the clock of its log.
struct ProposedFlight {
  double lasts_s = 0;
  std::function<std::array<double, 4>(double t_s)> goal;  ///< x, y, z in m and heading in rad, smooth
  std::function<std::array<double, 4>(double t_s)>
      excitation;  ///< to be added to the pilot's inputs: V, V, V, split cycle
};

/// One robot, its effects, and what it flies.
struct Assignment {
  std::filesystem::path vehicle_file;                   ///< the declared vehicle; each family has its own reader
  std::vector<std::pair<std::string, double>> effects;  ///< id, magnitude: 1 is typical of a 12 g robot, at most 4
  std::uint64_t seed = 0;  ///< draws the robot, its sensors, and random properties of its effects
  /// Session of flights. In session 0 the robot is as drawn. A later one has programmes and noise of its own, and what
  /// changes harmlessly from day to day has changed: weather, a warm winding, a battery put back, ...
  std::size_t session = 0;
  /// The session whose programmes are flown, as all noise stays that of `session`; none: `session`.
  std::optional<std::size_t> programme_of = {};
  bool hover = false;                 ///< hover only; else rich flights, which vary place, speed and inputs
  bool calm = false;                  ///< flight 0 hovers, flights 1 and 2 follow slow paths; replaces rich flights
  bool own_parameters = false;        ///< draws each parameter of each body independently; else the file's values
  bool conventions = false;           ///< draws declarations within the habits of laboratories; else they are exact
  bool power = false, wings = false;  ///< whether currents and wing angles are logged
  /// Runs on a bench in place of flights: clamped to a six-axis force sensor, wings filmed. Needs Family::has_bench().
  bool bench = false;
  const ProposedFlight* proposed = nullptr;  ///< replaces hover and rich flights; null: none
  model::Changes changes;                    ///< made to the robot on purpose before these flights; the log says them

  /// Effects less those that `changes` took away.
  std::vector<std::pair<std::string, double>> present_effects() const {
    std::vector<std::pair<std::string, double>> present = effects;
    std::erase_if(present, [&](const auto& e) { return std::ranges::count(changes.without, e.first) > 0; });
    return present;
  }
};

struct FamilyFlight {
  bool crashed = false;
  std::string how;           ///< how it crashed; empty if it did not
  flightlog::FlightLog log;  ///< begins at t = 0, after the trimming
};

/// Change by an effect along a flight without it. For each beat of the log: start, then mean, cosine and sine of two
/// harmonics of specific force at the IMU (m/s^2, B) and angular acceleration (rad/s^2, B). The torso is led along the
/// flown path; all other states evolve freely.
struct Contrast {
  std::vector<double> beat_s;
  std::vector<std::array<double, 30>> change;  ///< [beat][channel x 5 + coefficient]
};

/// Maps an observation (SI units, ordered as EscapeAssignment::observation) to V, V, V, split cycle, added to the
/// controller's.
using NamedPolicy = std::function<std::array<double, 4>(const std::vector<double>& observation)>;

/// The escape under the conditions of the policy's training; names and values are those of the task file.
struct EscapeAssignment {
  std::vector<std::string> observation;
  NamedPolicy policy;
  double action_period_s = 0.01;
  std::array<double, 3> start_m{}, start_half_m{};  ///< start less goal, uniform within +- half
  double heading_rad = 0, heading_half_rad = 0, x_low_m = -1e9, x_high_m = 1e9;
  struct Bounds {
    double distance_m, speed_m_s, body_rate_rad_s, tilt_rad, heading_rad;
  } hand_back{}, capture{}, keep{};
  double hand_back_at_s = 0, capture_by_s = 0, keep_from_s = 0, keep_until_s = 0;
};

struct FamilyEscape {
  bool success = false, crashed = false;
  double captured_s = 0;  ///< 0 if never
  flightlog::FlightLog log;
};

/// A firmware: it gets samples as they arrive, and sets the motors' voltages. Times are the log's.
class OnBoard {
 public:
  using Pose = std::array<double, 7>;  ///< torso origin in W, m; attitude w, x, y, z, B to W
  virtual ~OnBoard() = default;
  /// The robot is at rest in the air.
  virtual void start(double now_s, const Pose& pose) = 0;
  /// Rate, rad/s, and specific force, m/s^2, in the axes of the IMU.
  virtual void imu(double arrived_s, const std::array<double, 3>& rate, const std::array<double, 3>& force) = 0;
  virtual void pose(double arrived_s, const Pose& pose) = 0;
  /// Voltages (left, right) until the next call; all that has arrived by now was handed over.
  virtual std::array<double, 2> volts(double now_s) = 0;
};

class Family {
 public:
  virtual ~Family() = default;
  virtual std::string name() const = 0;
  /// An engine whose version is part of its robots, as "MuJoCo 2.2.2"; empty: none.
  virtual std::string engine() const { return ""; }
  virtual const std::vector<FamilyEffect>& effects() const = 0;
  /// Whether its robots can be clamped (Assignment::bench).
  virtual bool has_bench() const { return false; }
  static constexpr std::size_t kFlights = 3;
  static constexpr double kFlight_s = 10;
  /// Flies flight 0, 1 or 2, or 3, the proposed one; the robot trims for some seconds before the log. Returns the same
  /// bytes for the same arguments, with any number of threads, on all processors of one kind. On a bench, runs 0 to 2 hold
  /// inputs for 2 s each, 37 points in all, and end with a sweep, of about 27 s each; the films of two of them hold ten
  /// points between them.
  virtual FamilyFlight fly(const Assignment& a, std::size_t flight) const = 0;
  virtual Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect,
                            double magnitude) const = 0;
  /// Flies under a firmware, from rest at `start` (x, y, z in m, heading in rad) and t = 0 on; it may tumble. The log has
  /// no inputs of the beat and no phase.
  virtual FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start,
                                    double lasts_s, OnBoard& firmware) const = 0;
  virtual FamilyEscape escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules) const = 0;
  /// The law of an effect by itself, as the flights apply it: magnitude 1, the nominal vehicle. Arguments and outcomes:
  /// lab/benchmark/laws.hpp. Empty: the effect is geometry, or none has been written down.
  virtual std::vector<double> law(const std::string& effect, std::span<const double> at) const {
    (void)effect, (void)at;
    return {};
  }
};

}  // namespace flappy::blind
