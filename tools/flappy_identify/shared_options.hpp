// Options that several subcommands have.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "identify/force_map.hpp"

namespace flappy::identify {

/// Which vehicle, and how its map is simulated.
struct MapSource {
  std::string vehicle, moment_point = "0,0,0";
  int threads = 0;

  void add(CLI::App& app, const std::string& vehicle_help);
  model::Vehicle read_vehicle() const;
  /// The point is "x,y,z" in metres, or "com": the centre of mass of `vehicle`.
  MapOptions options(const model::Vehicle& vehicle) const;
};

/// What any seed is checked by: no negative number, which would wrap.
CLI::Range seeds();

}  // namespace flappy::identify
