// The parts of check_flight().
#pragma once

#include <string>
#include <vector>

#include "flightlog/check/check.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {

/// What a deviation must exceed to be no accident, in standard deviations: one in 16,000.
inline constexpr double kSigmas = 4;

using io::format;
using log_file::kAttitude, log_file::kCommand, log_file::kImu, log_file::kMocap, log_file::kPower, log_file::kWings;

using Findings = std::vector<Finding>;

/// Index of the last time not after t; times.size() where there is none.
std::size_t index_before(const std::vector<double>& times, double t);

/// The line of a stream's file at a time since its first sample.
std::size_t line_at(const Column& t_s, double after_s);

/// Rate of rises through the mean, from the median of the time between them; nothing with fewer than five.
std::optional<double> beat_frequency(const Column& t_s, const Column& values);

/// Gyro, attitude, accelerometer, position and their clocks.
void check_motion(const FlightLog& log, Findings& findings);
/// Positions against the ground, the ceiling and the walls.
void check_space(const FlightLog& log, Findings& findings);
/// The beat of the other streams against that of the voltages: their clocks.
void check_beat(const FlightLog& log, Findings& findings);
/// Voltages against the frequency, inputs and phase of the beat.
void check_command(const FlightLog& log, Findings& findings);
/// Declared inputs, each against itself over the flight; a finding for each, "input NAME".
void check_inputs_apart(const FlightLog& log, Findings& findings);
/// The same inputs of several flights against one another, in those findings.
void compare_inputs(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings);
/// How they go along with one another, of three flights or more.
void compare_correlations(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings);
/// The middle of the window after the one at `middle_s`, of windows side by side, `span_s` each. A gap in `t_s` of more than a thousand windows is passed over
/// at once: no work grows with its length.
double next_window(const Column& t_s, double middle_s, double span_s);
void check_power(const FlightLog& log, Findings& findings);
void check_wings(const FlightLog& log, Findings& findings);

}  // namespace flappy::flightlog
