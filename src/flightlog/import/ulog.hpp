// PX4's ULog: what a flight controller logged (docs.px4.io, "ULog File Format").
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Whether a file begins as one.
bool is_ulog(std::string_view bytes);

/// Adds all topics: channel "sensor_combined[0]", fields "gyro_rad[0]". A row was received at its timestamp, and tells of its
/// timestamp_sample where it has one, else of its timestamp. What is damaged is left out, and a file that ends early is read as far as
/// it goes; warnings say so. InputError, naming `name`, where this is no ULog.
void read_ulog(std::string_view bytes, const std::string& name, Channels& channels, std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
