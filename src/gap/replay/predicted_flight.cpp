#include "gap/replay/predicted_flight.hpp"

#include <algorithm>

namespace flappy::gap {

const char* channel_name(int channel) {
  static const char* const kNames[kChannels] = {
      "torque_x",    "torque_y",     "torque_z", "force_x",      "force_y",       "force_z",
      "stroke_left", "stroke_right", "battery",  "current_left", "current_right", "path_x",
      "path_y",      "path_z",       "rotate_x", "rotate_y",     "rotate_z"};
  return kNames[channel];
}

const char* channel_unit(int channel) {
  if (channel < kForceX) return "rad/s^2";
  if (channel < kStrokeLeft) return "m/s^2";
  if (channel < kBattery) return "rad";
  if (channel < kPathX) return channel == kBattery ? "V" : "A";
  return channel < kTurnX ? "m/s^2" : "rad/s";
}

Flights tests_of(const Flights& flights) {
  return {flights.begin() + static_cast<std::ptrdiff_t>(references_of(flights).size()), flights.end()};
}

Flights references_of(const Flights& flights) {
  const auto tests = std::ranges::find_if(flights, [](const auto& f) { return !f->is_reference(); });
  return tests == flights.end() ? Flights() : Flights(flights.begin(), tests);
}

}  // namespace flappy::gap
