// The blind robot flies a policy's manoeuvre: the observation, the action and the hand-back that the policy was trained with
// (flight/episode.hpp), and its success judged as there; physics, sensors and the view of the state are the robot's own.
#pragma once

#include <functional>

#include "blind/a/flights.hpp"
#include "flight/episode.hpp"

namespace flappy::blind {

/// From an observation to what is added to the controller's output: V, V, V, split cycle.
using ObservationPolicy = std::function<std::array<double, 4>(const std::vector<double>& observation)>;

struct EscapeRules {
  flight::Task task;                        ///< its goal stands still: the path has one segment
  flight::TaskConstants<double> constants;  ///< of its task
  flight::PidConstants<double> controller;  ///< that hovers before and after, and whose trim the policy adds to
  ObservationPolicy policy;
};

struct Escape {
  RobotFlight flight;
  double captured_s = 0, lost_s = 0;  ///< 0: never
  std::uint32_t ended = 0;            ///< bits of flight::Ended
};

/// Escape `number` of a case: hover where the task's start is drawn, a metre up, then the manoeuvre from t = 0 of the log on.
/// The same bytes for the same case.
Escape escape(const Case& c, std::size_t number, const EscapeRules& rules);

}  // namespace flappy::blind
