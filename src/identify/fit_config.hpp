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

/// Reads the parameters in `chosen`, or all if it is empty. InputError "file:line:column: key: ..." where the vehicle
/// lacks one, where one comes twice, and where bounds are empty, exceed a vehicle file's range or exclude the vehicle's
/// value.
FitConfig read_fit_config(const std::filesystem::path& path, const model::Vehicle& vehicle,
                          const std::vector<std::string>& chosen = {});

std::vector<double*> fitted_values(const FitConfig& config, model::Vehicle& vehicle);

}  // namespace flappy::identify
