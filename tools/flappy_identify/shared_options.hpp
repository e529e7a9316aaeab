// Options that several subcommands have.
#pragma once

#include <string>

#include "identify/force_map.hpp"
#include "io/command_line.hpp"

namespace flappy::identify {

/// Which vehicle, and how its map is simulated.
struct MapSource {
  std::string vehicle, moment_point = "0,0,0";
  int threads = 0;

  void add(const io::Command& app, const std::string& vehicle_help);
  model::Vehicle read_vehicle() const;
  /// The point is "x,y,z" in metres, or "com": the centre of mass of `vehicle`.
  MapOptions options(const model::Vehicle& vehicle) const;
};

/// No seed is a negative number, which would wrap.
inline constexpr std::uint64_t kLargestSeed = INT64_MAX;

}  // namespace flappy::identify
