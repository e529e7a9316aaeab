// One flight of a robot of family C from its release on.
#pragma once

#include "blind/c/programme.hpp"
#include "blind/c/sensors.hpp"
#include "io/files.hpp"

namespace flappy::blind::c {

/// The robot trims itself for so long before a log begins, which lasts for so long.
struct Length {
  double trim_s = 5, flight_s = Family::kFlight_s;
};

struct Flown {
  FamilyFlight flight;
  std::vector<std::array<double, 2>> voltages;  ///< of each tick, from the release on
  std::vector<Motion> path;  ///< pose and motion at the start of each step with the acceleration in it, and of the end
};

Flown fly_one(const Assignment& a, std::size_t flight, bool keep_path = false, Length length = {});

/// Phase of the beat from 0 to 1; one begins at t = 0.
double beat_phase(double t_s, double flapping_Hz);
/// A row of the log's commands, with the inputs.
void add_command(flightlog::CommandStream& commands, double t_s, const std::array<double, 2>& voltages,
                 const Inputs& inputs, double phase);
/// What the robot has run into, or that it is upside down; empty if nothing.
std::string trouble(const Robot& robot, bool may_tumble);

}  // namespace flappy::blind::c
