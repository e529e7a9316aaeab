// The blind robot flies a policy's manoeuvre, judged as in training (flight/episode.hpp); physics, sensors and view are
// its own.
#pragma once

#include <functional>

#include "flight/episode.hpp"
#include "lab/blind/a/flights.hpp"

namespace flappy::blind {

/// Maps an observation to inputs that are added to the controller's: V, V, V, split cycle.
using ObservationPolicy = std::function<std::array<double, 4>(const std::vector<double>& observation)>;

struct EscapeRules {
  flight::Task task;                        ///< with a goal that stands still: its path has one segment
  flight::TaskConstants<double> constants;  ///< derived from the task
  flight::PidConstants<double> controller;  ///< hovers before and after the manoeuvre
  ObservationPolicy policy;
};

struct Escape {
  RobotFlight flight;
  double captured_s = 0, lost_s = 0;  ///< 0 if never
  std::uint32_t ended = 0;            ///< bits of flight::Ended
};

/// Flies escape `number` of a case: hover at a start drawn from the task, raised by 1 m; the manoeuvre begins at t = 0
/// of the log. Returns the same bytes for the same arguments.
Escape escape(const Case& c, std::size_t number, const EscapeRules& rules);

}  // namespace flappy::blind
