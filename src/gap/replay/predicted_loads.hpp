// What somebody's own simulator says of force and moment on a vehicle in a recorded flight (model = "predicted"): FOLDER/predicted.csv,
//
//   t_s                                      on the clock of command.csv; from the beginning of what motion capture and commands have in common
//                                            to its end, and often enough for the vehicle's beat.bandwidth_Hz
//   force_x_N ... moment_z_Nm                in B, about the torso's origin: all that acts but weight, with each coefficient of the vehicle's
//                                            file as its predicted_at, for the recorded inputs and motion
//   d_NAME_force_x_N ... d_NAME_moment_z_Nm  its derivatives by the coefficient NAME, per unit of that
//
// so that the vehicle's load is   load + sum d_NAME (NAME - predicted_at).   Columns that are left out are 0.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/mean_motion.hpp"

namespace flappy::gap {

struct PredictedColumn {
  std::size_t component;                   ///< of force, then moment
  std::optional<std::size_t> coefficient;  ///< that it is the derivative by; none: the load itself
  std::vector<double> values;  ///< N or N m, over the coefficient's unit, at every step of the motion's grid
};

/// `from_s`, `to_s`: what motion capture and commands have in common. io::InputError by file and line of what is no prediction of this
/// vehicle in this flight.
std::vector<PredictedColumn> read_predicted_loads(const std::filesystem::path& file, const model::BeatAveraged& vehicle,
                                                  const flightlog::MeanMotion& motion, double from_s, double to_s);

}  // namespace flappy::gap
