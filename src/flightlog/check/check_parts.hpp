// The parts of check_flight().
#pragma once

#include <string>
#include <vector>

#include "flightlog/check/check.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {

/// A deviation beyond this many standard deviations is significant: noise exceeds it once in 16,000.
inline constexpr double kSigmas = 4;

using io::format;
using log_file::kAttitude, log_file::kCommand, log_file::kImu, log_file::kMocap, log_file::kPower, log_file::kWings,
    log_file::kForces;

using Findings = std::vector<Finding>;

/// Index of the last time not after t; times.size() if all are after it.
std::size_t index_before(const std::vector<double>& times, double t);

/// Line in a stream's file of the first sample at least `after_s` after the first one; else its last line.
std::size_t line_at(const Column& t_s, double after_s);

/// Frequency, Hz, from the median time between upward crossings of the mean; nothing with fewer than five crossings.
std::optional<double> beat_frequency(const Column& t_s, const Column& values);

/// Compares gyro, attitude, accelerometer, position and their clocks with one another.
void check_motion(const FlightLog& log, Findings& findings);
/// Compares positions with the ground, the ceiling and the walls.
void check_space(const FlightLog& log, Findings& findings);
/// Compares the beat frequency of IMU, power and wings with that of the voltages: a difference shows a wrong clock.
void check_beat(const FlightLog& log, Findings& findings);
/// Compares the voltages with the declared frequency and with the logged inputs and phase of the beat.
void check_command(const FlightLog& log, Findings& findings);
/// Finds axes of the IMU that are clipped at its range.
void check_range(const FlightLog& log, Findings& findings);
/// Single samples of a column, such as the speed of a rotor, that drop to 0 or half of those around; none: fewer than
/// three. `check`: name of the finding.
std::optional<Finding> dropped_readings(const std::string& check, const Column& values);
/// A voltage that no longer changes, or never did; none: it changes.
std::optional<Finding> frozen_battery(const PowerStream& power);
/// Checks that each declared input keeps its meaning over the flight; adds one finding for each, "input NAME".
void check_inputs_apart(const FlightLog& log, Findings& findings);
/// Compares the levels of each input between flights; changes the findings of check_inputs_apart().
void compare_inputs(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings);
/// Compares the correlations between inputs across three flights or more; changes the same findings.
void compare_correlations(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings);
/// Middle of the window after that at `middle_s`; windows last `span_s` and adjoin. A gap of more than a thousand
/// windows is skipped in one step, so the work does not grow with it.
double next_window(const Column& t_s, double middle_s, double span_s);
/// Compares the force of a clamped robot with its voltages, and the sensor's resonance with the beat.
void check_rig(const FlightLog& log, Findings& findings);
void check_power(const FlightLog& log, Findings& findings);
void check_wings(const FlightLog& log, Findings& findings);

}  // namespace flappy::flightlog
