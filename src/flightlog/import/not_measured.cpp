#include "flightlog/import/not_measured.hpp"

#include <algorithm>
#include <optional>

namespace flappy::flightlog {
namespace {

constexpr std::string_view kCovariance = "_covariance[0]";

/// "sensor_combined" of "px4_msgs/msg/SensorCombined"; other types as they are.
std::string name_of(std::string_view type) {
  constexpr std::string_view kPx4 = "px4_msgs/msg/";
  if (!type.starts_with(kPx4)) return std::string(type);
  std::string name;
  for (const char c : type.substr(kPx4.size())) {
    const bool large = c >= 'A' && c <= 'Z';
    if (large && !name.empty()) name += '_';
    name += large ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return name;
}

std::optional<double> value_of(const Row& row, std::string_view field) {
  const auto found = std::ranges::find(row, field, &Item::name);
  return found == row.end() ? std::nullopt : std::optional(found->value);
}

bool is(const Row& row, std::string_view field, double value) { return value_of(row, field) == value; }

}  // namespace

NotMeasured::NotMeasured(std::string_view type) : type_(name_of(type)) {}

void NotMeasured::mark(Row& row) {
  fields_.clear();
  for (const Item& item : row)
    if (item.value == -1 && item.name.ends_with(kCovariance))
      fields_.push_back(item.name.substr(0, item.name.size() - kCovariance.size()));
  if (type_ == "sensor_msgs/msg/Range") {
    const auto range = value_of(row, "range"), low = value_of(row, "min_range"), high = value_of(row, "max_range");
    if (range && low && high && (*range < *low || *range > *high)) fields_.emplace_back("range");
  } else if (type_ == "sensor_msgs/msg/NavSatFix") {
    if (value_of(row, "status.status").value_or(0) < 0)
      fields_.insert(fields_.end(), {"latitude", "longitude", "altitude"});
  } else if (type_ == "sensor_combined") {
    if (is(row, "accelerometer_timestamp_relative", 0x7fffffff)) fields_.emplace_back("accelerometer_m_s2");
  } else if (type_.find("local_position") != std::string::npos) {
    if (is(row, "xy_valid", 0)) fields_.insert(fields_.end(), {"x", "y"});
    if (is(row, "z_valid", 0)) fields_.emplace_back("z");
    if (is(row, "v_xy_valid", 0)) fields_.insert(fields_.end(), {"vx", "vy"});
    if (is(row, "v_z_valid", 0)) fields_.emplace_back("vz");
    if (is(row, "dist_bottom_valid", 0)) fields_.emplace_back("dist_bottom");
  } else if (type_ == "battery_status") {
    if (is(row, "voltage_v", 0)) fields_.emplace_back("voltage_v");
    if (is(row, "current_a", -1)) fields_.emplace_back("current_a");
  } else if (type_ == "distance_sensor") {
    if (is(row, "signal_quality", 0)) fields_.emplace_back("current_distance");
  }
  for (const std::string& field : fields_)
    for (Item& item : row)
      if (item.name.starts_with(field) &&
          (item.name.size() == field.size() || item.name[field.size()] == '.' || item.name[field.size()] == '['))
        item.value = kNotMeasured;
}

}  // namespace flappy::flightlog
