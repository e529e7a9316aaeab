#pragma once

#include "io/files.hpp"
#include "lab/blind/c/c_sensors.hpp"
#include "lab/blind/c/programme.hpp"

namespace flappy::blind::c {

/// Durations of the trimming before the log, and of the log.
struct Length {
  double trim_s = 5, flight_s = Family::kFlight_s;
};

struct Flown {
  FamilyFlight flight;
  std::vector<std::array<double, 2>> voltages;  ///< for each tick since the release
  std::vector<Motion> path;  ///< at the start of each step, with the acceleration during it; last: the end
};

Flown fly_one(const Assignment& a, std::size_t flight, bool keep_path = false, Length length = {});

/// Family::fly_on_board().
FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start, double lasts_s,
                          OnBoard& firmware);

/// Phase of the beat from 0 to 1; a beat begins at t = 0.
double beat_phase(double t_s, double flapping_Hz);
void add_command(flightlog::CommandStream& commands, double t_s, const std::array<double, 2>& voltages,
                 const Inputs& inputs, double phase);
/// Cause of a crash: contact, divergence, leaving the room or, unless `may_tumble`, turning over; empty if none.
std::string trouble(const Robot& robot, bool may_tumble);

}  // namespace flappy::blind::c
