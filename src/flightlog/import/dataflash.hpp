// Reads the logs of ArduPilot, DataFlash (ardupilot.org, "Logging in Ardupilot"): binary messages of 0xA3, 0x95, a type
// and numbers without gaps, or lines of text. Messages FMT say of each type its length, name, the letter of each number
// and the names; messages FMTU say by '#' which number is the instance of a sensor. Letters [1]:
//   b B h H i I q Q f d g (half), M (mode)   numbers;      n N Z   texts of 4, 16, 64 bytes;      a   32 of int16
//   c C e E   1/100 of h H i I;   L   1e-7 of i (degrees).  In a text log these are written scaled.
// [1] ArduPilot, libraries/AP_Logger/LogStructure.h.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Whether a log is binary, or a text.
bool is_dataflash(std::string_view bytes);
bool is_dataflash_text(std::string_view bytes);

/// Adds each wanted type as a channel, "ATT"; of a type with instances each, "IMU[0]". Times of receipt and stamps are
/// TimeUS or TimeMS, since the autopilot's start. Damaged parts are skipped, and an early end is accepted, both with a
/// warning.
void read_dataflash(std::string_view bytes, const std::string& name, Channels& channels,
                    std::vector<std::string>& warnings);
void read_dataflash_text(std::string_view text, const std::string& name, Channels& channels,
                         std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
