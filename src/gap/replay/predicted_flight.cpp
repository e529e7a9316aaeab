#include "gap/replay/predicted_flight.hpp"

#include <numbers>
#include <optional>

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

namespace {

/// First and last channel of a stream; none: the error is not one of its times.
std::optional<std::pair<int, int>> channels_of_stream(const std::string& error) {
  if (error == "forces_clock" || error == "forces_delay") return std::pair{kAngularAccelerationX, kSpecificForceZ};
  if (error == "wings_clock" || error == "wings_delay") return std::pair{kStrokeLeft, kRotationRight};
  if (error == "power_clock" || error == "power_delay") return std::pair{kBattery, kCurrentRight};
  return std::nullopt;
}

}  // namespace

bool is_lateness(const std::string& error) { return channels_of_stream(error).has_value(); }

Rows late_rows(const PredictedFlight& run, const std::string& error, const std::string& value, double size) {
  Rows rows(run.measured().size(), 0.0);
  const auto channels = channels_of_stream(error);
  if (!channels) return rows;
  for (std::size_t beat = 0; beat < run.beats(); ++beat) {
    const double since_s = (static_cast<double>(beat) - (static_cast<double>(run.beats()) - 1) / 2) / run.beats_Hz();
    const double late_s = size * (value == "rate" ? since_s : 1);
    for (int channel = channels->first; channel <= channels->second; ++channel)
      for (std::size_t h = 1; h <= kHarmonics; ++h) {
        const double turn = 2 * std::numbers::pi * static_cast<double>(h) * run.beats_Hz() * late_s;
        const std::size_t c = row_of_mean(beat, channel) + 2 * h - 1, s = c + 1;
        rows[c] = -turn * run.measured()[s];
        rows[s] = turn * run.measured()[c];
      }
  }
  return rows;
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
