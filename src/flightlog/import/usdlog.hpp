// Reads the logs that the Crazyflie's firmware writes to its microSD card (usdlog, versions 1 and 2), as the Flapper
// Nimble+ does, too. All numbers are little-endian:
//   0xBC, version (uint16), number of kinds of events (uint16)
//   for each kind: number (uint16), name, number of variables (uint16), each as "group.name(T)", T: type as in Python's
//     struct; texts end with a zero byte
//   events: number of the kind (uint16), time in ms (uint32; version 1) or in us (uint64; version 2), the variables
//   CRC-32 of all that is before it (uint32)
// [1] bitcraze/crazyflie-firmware, src/deck/drivers/src/usddeck.c and tools/usdlog/cfusdlog.py.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

bool is_usdlog(std::string_view bytes);

/// Adds a channel for each wanted kind of event, as "fixedFrequency", with fields as "stateEstimate.x". Times of receipt
/// and stamps are those of the events. Warns of a wrong checksum; a file that is cut off or damaged is read as far as it
/// goes, with a warning. InputError, beginning with `name`, where the head cannot be read.
void read_usdlog(std::string_view bytes, const std::string& name, Channels& channels,
                 std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
