// The parameters of a vehicle that a fit may change, and their bounds.
//
//   schema = 1
//   unseen_share = 0.5              # a parameter whose 95 % interval is wider than this share of its bounds is unseen
//   [[parameter]]
//   name = "left.motor.resistance_ohm"    # a path of the vehicle's file
//   low = 9.5
//   high = 16.1
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::identify {

struct FitParameter {
  std::string path;
  double low = 0, high = 0;
};

struct FitConfig {
  std::vector<FitParameter> parameters;
  double unseen_share = 0;
};

/// Reads the parameters whose paths are in `chosen`, or all if it is empty. InputError "file:line:column: key: ..." for
/// a parameter that the vehicle lacks, that comes twice, or whose bounds are empty, exceed the range that a vehicle
/// file accepts or exclude the vehicle's own value.
FitConfig read_fit_config(const std::filesystem::path& path, const model::Vehicle& vehicle,
                          const std::vector<std::string>& chosen = {});

/// Pointers to the parameters of `config` in `vehicle`.
std::vector<double*> fitted_values(const FitConfig& config, model::Vehicle& vehicle);

}  // namespace flappy::identify
