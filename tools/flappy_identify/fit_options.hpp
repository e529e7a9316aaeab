// Options of a fit, shared by the subcommands that fit.
#pragma once

#include <string>
#include <vector>

#include "identify/force_fit.hpp"
#include "io/command_line.hpp"

namespace flappy::identify {

struct FitSettings {
  std::string method = "gn", config;
  std::vector<std::string> parameters;
  unsigned population = 200, generations = 200;
  int starts = 3;
  std::uint64_t seed = 1;

  void add(const io::Command& app);
  FitConfig read_config(const model::Vehicle& vehicle) const;
  FitOptions options(const MapOptions& map) const;
};

}  // namespace flappy::identify
