#pragma once

#include "lab/blind/b/b_pilot.hpp"
#include "lab/blind/b/b_robot.hpp"
#include "lab/blind/b/b_sensors.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind::b {

inline constexpr double kTrim_s = 5;

struct Case {
  RobotParameters parameters;
  EffectMagnitudes effect_magnitudes;
  Surroundings room;
  flightlog::FlightHeader header;
  SensorTruth sensors;
  PilotGains gains;
};
Case make_case(const Assignment& a);

/// Adds inputs that are sent at `now_s`, with their voltages and phase, to a log; `before_s` s had passed at its start.
void add_command(const RobotParameters& f, const Beat& sent, double now_s, double before_s,
                 flightlog::CommandStream& to);

/// Radio link: returns the sent inputs or, while packets are lost (command dropout), the last that arrived.
class Radio {
 public:
  Radio(std::uint64_t seed, std::uint64_t flight, double magnitude, double begins_s);
  Beat arrived(const Beat& sent, double now_s);

 private:
  Random random_;
  double magnitude_, returns_s_ = -1e9, fails_s_;
  Beat last_;
};

/// A robot with its sensors and pilot, advanced by ticks from t = -trim_s on.
class Flight {
 public:
  /// `flight`: the number under which it draws.
  Flight(const Assignment& a, const Case& c, std::uint64_t flight, const Vector3d& start_m, double heading_rad,
         double trim_s);

  /// Flies one tick; inputs are held between the pilot's periods. Returns how the robot crashed, or an empty string.
  std::string tick(const Beat& sent, bool may_tumble = false);
  /// Gives the firmware the samples that have arrived, and flies a tick with its voltages.
  std::string tick(OnBoard& firmware);
  double time_s() const { return static_cast<double>(ticks_) * kTick_s - trim_s_; }
  long ticks() const { return ticks_; }
  bool steers_now() const { return ticks_ % 2 == 0; }
  const View& view() const { return observer_.view(); }
  const Robot& robot() const { return robot_; }
  Pilot& pilot() { return pilot_; }
  /// Records the torso's path in `path` from now on; null: no recording.
  void record(Path* path) { path_ = path; }
  flightlog::FlightLog log(double end_s) const;

 private:
  Robot robot_;
  Sensors sensors_;
  Observer observer_;
  Pilot pilot_;
  Radio radio_;
  double trim_s_;
  long ticks_ = 0;
  /// Flies the tick whose voltages or beat the drivers have.
  std::string fly(bool may_tumble);
  Path* path_ = nullptr;
  flightlog::FlightLog log_;
};

}  // namespace flappy::blind::b
