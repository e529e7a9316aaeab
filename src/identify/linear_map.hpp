// The force map as four straight lines, as published for the real robot: thrust against amplitude, roll against difference,
// pitch against bias, yaw against split cycle.
#pragma once

#include <array>
#include <filesystem>

#include "identify/force_map.hpp"

namespace flappy::identify {

inline constexpr std::array<const char*, 4> kLineNames = {"thrust", "roll", "pitch", "yaw"};

/// offset + slope x input, in N or N m; of thrust per V of amplitude, extrapolated to 0 V.
struct Line {
  double slope = 0, offset = 0;
};
using LinearMap = std::array<Line, 4>;

/// InputError "file:line:column: ..." as every configuration.
LinearMap read_published_map(const std::filesystem::path& path);

/// Least squares through sweeps of one input each: amplitude from 5 to 14 V; the others at 10 V, as default_inputs() has them.
LinearMap linear_map(const model::Vehicle& vehicle, const MapOptions& options = {});

}  // namespace flappy::identify
