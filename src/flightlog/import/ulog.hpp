// Reads ULog, the log format of PX4 (docs.px4.io, "ULog File Format").
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

bool is_ulog(std::string_view bytes);

/// Adds wanted topics: channel "sensor_combined[0]", fields "gyro_rad[0]". Time of receipt: timestamp; stamp:
/// timestamp_sample, else timestamp. Damaged messages are left out, and an early end is accepted, both with a warning.
/// InputError, beginning with `name`, where this is no ULog.
void read_ulog(std::string_view bytes, const std::string& name, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
