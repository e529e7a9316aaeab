// Reads ULog, the log format of PX4 (docs.px4.io, "ULog File Format").
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Whether `bytes` begin like a ULog.
bool is_ulog(std::string_view bytes);

/// Adds all wanted topics: channel "sensor_combined[0]", fields "gyro_rad[0]". The time of receipt of a row is its
/// timestamp; its stamp is timestamp_sample where it has one, else timestamp. Damaged messages are left out, and a file
/// that ends early is read up to there; both give a warning. InputError, beginning with `name`, where this is no ULog.
void read_ulog(std::string_view bytes, const std::string& name, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
