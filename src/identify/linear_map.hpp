// The force map as the four straight lines published for the real robot: thrust against amplitude, roll against
// difference, pitch against bias, yaw against split cycle.
#pragma once

#include <array>
#include <filesystem>

#include "identify/force_map.hpp"

namespace flappy::identify {

inline constexpr std::array<const char*, 4> kLineNames = {"thrust", "roll", "pitch", "yaw"};

/// offset + slope x input, in N or N m. The offset of thrust is extrapolated to an amplitude of 0 V.
struct Line {
  double slope = 0, offset = 0;
};
using LinearMap = std::array<Line, 4>;

/// Reads a published map. InputError "file:line:column: ..." for a faulty file.
LinearMap read_published_map(const std::filesystem::path& path);

/// Least squares over the sweeps of default_inputs(): amplitude from 5 to 14 V, other inputs at 10 V.
LinearMap linear_map(const model::Vehicle& vehicle, const MapOptions& options = {});

}  // namespace flappy::identify
