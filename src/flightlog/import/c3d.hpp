// Reads C3D, the motion capture format of c3d.org (C3D User Guide): a header of 512 bytes, parameters in named groups,
// frames of points and analog samples as 16-bit integers or floats, in the byte order of Intel, DEC or MIPS processors,
// and the rotations of C-Motion behind them. A reader of our own: libraries that read all of this are Python's or need
// a build of their own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

bool is_c3d(std::string_view bytes);

/// Adds, without times of receipt and stamps, `channel`, the points: "t" in s from the first frame, "frame", its number
/// in the recording, and of each label "LABEL.x", ".y", ".z", ".residual" in m, missing where the point was not seen;
/// `channel`.analog: "t" and the labels, in units of the file; `channel`.rotation: "t", "LABEL.x" to ".z", ".qw" to
/// ".qz". What is cut off or contradictory gives a warning. InputError, beginning with `name`, where it cannot be read.
void read_c3d(std::string_view bytes, const std::string& name, const std::string& channel, Channels& channels,
              std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
