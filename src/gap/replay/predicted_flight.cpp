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
                                                "rotation_left",
                                                "rotation_right",
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

std::vector<Rows> PredictedFlight::compare(const std::vector<ComparedVehicle>& vehicles) const {
  std::vector<Rows> list;
  while (list.size() < vehicles.size()) {
    const EffectValues& undone = vehicles[list.size()].undone;
    std::vector<const VehicleHypothesis*> together;
    for (std::size_t i = list.size(); i < vehicles.size() && vehicles[i].undone == undone; ++i)
      together.push_back(vehicles[i].vehicle);
    const std::shared_ptr<const PredictedFlight> other = undone.empty() ? nullptr : corrected(undone);
    const PredictedFlight& seen = other ? *other : *this;
    for (Rows& rows : seen.predict(together)) {
      for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = seen.measured()[i] - rows[i];
      list.push_back(std::move(rows));
    }
  }
  return list;
}

bool PredictedFlight::clamped() const { return recording() != nullptr && recording()->clamped(); }

FlightList Flights::all() const {
  FlightList list = references;
  list.insert(list.end(), tests.begin(), tests.end());
  return list;
}

}  // namespace flappy::gap
