// Options that several subcommands share.
#pragma once

#include <string>

#include "identify/force_map.hpp"
#include "io/command_line.hpp"

namespace flappy::identify {

/// The vehicle, and the settings for simulating its map.
struct MapSource {
  std::string vehicle, moment_point = "0,0,0";
  int threads = 0;

  void add(const io::Command& app, const std::string& vehicle_help);
  model::Vehicle read_vehicle() const;
  /// moment_point is "x,y,z" in metres, or "com": the centre of mass of `vehicle`. Throws InputError otherwise.
  MapOptions options(const model::Vehicle& vehicle) const;
};

/// Upper limit of seeds, which rejects negative numbers: they would wrap to larger values.
inline constexpr std::uint64_t kLargestSeed = INT64_MAX;

}  // namespace flappy::identify
