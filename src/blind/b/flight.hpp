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

/// What the wings get of the inputs that are sent: packets that are lost leave those of the last.
class Radio {
 public:
  Radio(std::uint64_t seed, std::uint64_t flight, double size, double begins_s);
  Beat arrived(const Beat& sent, double now_s);

 private:
  Random random_;
  double size_, returns_s_ = -1e9, fails_s_;
  Beat last_;
};

/// A robot with who flies it, tick by tick from -kTrim_s on.
class Flight {
 public:
  Flight(const Assignment& a, const Case& c, std::uint64_t flight, const Vector3d& start_m, double heading_rad,
         double trim_s);

  /// Flies one tick with these inputs of the pilot, held between its periods. Empty, or how it crashed.
  std::string tick(const Beat& sent, bool may_tumble = false);
  double time_s() const { return static_cast<double>(ticks_) * kTick_s - trim_s_; }
  long ticks() const { return ticks_; }
  bool steers_now() const { return ticks_ % 2 == 0; }
  const View& view() const { return observer_.view(); }
  const Robot& robot() const { return robot_; }
  Pilot& pilot() { return pilot_; }
  /// Records the torso's path.
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
  Path* path_ = nullptr;
  flightlog::FlightLog log_;
};

}  // namespace flappy::blind::b
