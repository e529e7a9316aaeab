// What flies in the tests of the closed loop: shipped configurations with keys replaced.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "flight/fleet.hpp"
#include "vehicles.hpp"

namespace flappy::flight {

/// Action of flapper `i` alone, of a task without history: the others of its block keep theirs.
template <class T>
void set_action(Fleet<T>& fleet, std::size_t i, std::type_identity_t<std::span<const T>> action) {
  std::size_t block = 0;
  while (fleet.flappers(block).second <= i) ++block;
  const auto [first, last] = fleet.flappers(block);
  std::vector<T> all;
  for (std::size_t k = first; k < last; ++k) {
    const auto own = fleet.action(k);
    all.insert(all.end(), own.begin(), own.begin() + static_cast<std::ptrdiff_t>(action.size()));
  }
  std::ranges::copy(action, all.begin() + static_cast<std::ptrdiff_t>((i - first) * action.size()));
  fleet.set_actions(block, all.data());
}

using Overrides = std::vector<std::string>;

inline Sensors sensors(const std::string& name, const Overrides& overrides = {}) {
  return read_sensors(io::Config::load(test::source_path("configs/sensors/" + name + ".toml"), overrides).root());
}
inline Controller controller(const std::string& name, const Overrides& overrides = {}) {
  if (name == "none") return {};
  return read_controller(io::Config::load(test::source_path("configs/controllers/" + name + ".toml"), overrides).root(),
                         500);
}
inline Task task(const std::string& text, double tick_s = 0.002) {
  return read_task(io::Config::parse(text, "task.toml").root(), tick_s);
}

/// The rest of a task after [start] and [path].
inline const std::string kPlainTask = R"(
[action]
amplitude_V = [-5.0, 5.0]
difference_V = [-3.0, 3.0]
bias_V = [-3.5, 3.5]
split_cycle = [-0.15, 0.15]
[reward]
alive = 1.0
position_1_m = 2.0
[end]
time_s = 1e5
contact = false
)";

inline std::string waypoint(double t_s, double x_m, double y_m, double z_m, double heading_rad = 0) {
  const auto key = [](const char* name, double value) { return name + std::to_string(value) + "\n"; };
  return "[[path.waypoint]]\n" + key("t_s = ", t_s) + key("x_m = ", x_m) + key("y_m = ", y_m) + key("z_m = ", z_m) +
         key("heading_rad = ", heading_rad);
}
inline std::string along(const std::string& waypoints, const std::string& start = "kind = \"flying\"",
                         const std::string& observation = "\"position_error\"") {
  return "schema = 1\nname = \"test\"\nobservation = [" + observation + "]\n[start]\n" + start +
         "\n[path]\nkind = \"waypoints\"\n" + waypoints + kPlainTask;
}
inline std::string staying(const std::string& start = "kind = \"flying\"") {
  return along(waypoint(0, 0, 0, 0), start);
}

/// A task whose actions are the motors' voltages.
inline std::string voltages_task(const std::string& observation = "\"position_error\", \"wings\"",
                                 const std::string& start = "kind = \"flying\"") {
  std::string text = along(waypoint(0, 0, 0, 0), start, observation);
  const std::size_t action = text.find("amplitude_V"), reward = text.find("[reward]");
  return text.replace(action, reward - action,
                      "kind = \"voltages\"\nleft_V = [-20.0, 18.0]\nright_V = [-17.0, 17.0]\n");
}

inline FleetOptions fleet_options(const Sensors& sensors, const Controller& controller, const Task& task,
                                  int threads = 1) {
  FleetOptions o;
  o.sensors = sensors;
  o.controller = controller;
  o.task = task;
  o.seed = 1;
  o.batch.threads = threads;
  return o;
}

}  // namespace flappy::flight
