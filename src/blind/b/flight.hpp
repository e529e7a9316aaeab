// One flight of one robot, from the ground crew's hands to the log.
#pragma once

#include "blind/b/pilot.hpp"
#include "blind/b/robot.hpp"
#include "blind/b/sensors.hpp"
#include "blind/family.hpp"

namespace flappy::blind::b {

inline constexpr double kTrim_s = 5;

/// The robot of an assignment with its figures, what is wrong with it and what is declared of it.
struct Case {
  Figures figures;
  Ailments ailments;
  Surroundings room;
  flightlog::FlightHeader header;
  SensorTruth sensors;
};
Case make_case(const Assignment& a);

/// A robot with who flies it, tick by tick from -kTrim_s on.
class Flight {
 public:
  Flight(const Assignment& a, const Case& c, std::uint64_t flight, const Vector3d& start_m, double heading_rad, double trim_s);

  /// Flies one tick with these inputs of the pilot, held between its periods. Empty, or how it crashed.
  std::string tick(const Beat& beat);
  /// What the wings get: those just steered, or the last that arrived.
  double time_s() const { return static_cast<double>(ticks_) * kTick_s - trim_s_; }
  long ticks() const { return ticks_; }
  bool steers_now() const { return ticks_ % 2 == 0; }
  const View& view() const { return observer_.view(); }
  const Robot& robot() const { return robot_; }
  Pilot& pilot() { return pilot_; }
  /// Records the torso's path.
  void record(Path* path) { path_ = path; }
  flightlog::FlightLog log(double end_s) const;
  /// Voltages of all ticks.
  const std::vector<std::array<double, 2>>& voltages() const { return voltages_; }

 private:
  Beat arrived(const Beat& sent);

  Robot robot_;
  Sensors sensors_;
  Observer observer_;
  Pilot pilot_;
  Random radio_;
  double trim_s_, radio_returns_s_ = -1e9, radio_fails_s_;
  Beat last_arrived_;
  long ticks_ = 0;
  Path* path_ = nullptr;
  flightlog::FlightLog log_;
  std::vector<std::array<double, 2>> voltages_;
};

}  // namespace flappy::blind::b
