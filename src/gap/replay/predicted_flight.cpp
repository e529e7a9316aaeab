#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

const char* channel_name(int channel) {
  static const char* const kNames[kChannels] = {"angular_acceleration_x",
                                                "angular_acceleration_y",
                                                "angular_acceleration_z",
                                                "specific_force_x",
                                                "specific_force_y",
                                                "specific_force_z",
                                                "stroke_left",
                                                "stroke_right",
                                                "battery",
                                                "current_left",
                                                "current_right",
                                                "path_x",
                                                "path_y",
                                                "path_z",
                                                "rotate_x",
                                                "rotate_y",
                                                "rotate_z"};
  return kNames[channel];
}

const char* channel_unit(int channel) {
  if (channel < kSpecificForceX) return "rad/s^2";
  if (channel < kStrokeLeft) return "m/s^2";
  if (channel < kBattery) return "rad";
  if (channel < kPathX) return channel == kBattery ? "V" : "A";
  return channel < kRotateX ? "m/s^2" : "rad/s";
}

FlightList Flights::all() const {
  FlightList list = references;
  list.insert(list.end(), tests.begin(), tests.end());
  return list;
}

}  // namespace flappy::gap
