// Reads the loads on a beat-averaged vehicle in a flight, as the user's simulator predicts them (model = "predicted"):
// FOLDER/predicted.csv,
//   t_s                                      on the clock of command.csv; covers the time common to motion capture and
//                                            commands, in steps of at most half a period of beat.bandwidth_Hz
//   force_x_N ... moment_z_Nm                in B, about the torso's origin: the sum of all loads but weight, for the
//                                            recorded inputs and motion, with each coefficient at its predicted_at
//   d_NAME_force_x_N ... d_NAME_moment_z_Nm  derivatives by the coefficient NAME, per unit of NAME
// For other coefficients:   load = column + sum d_NAME (NAME - predicted_at).   Missing columns are 0.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/beat_averaged_motion.hpp"

namespace flappy::gap {

struct PredictedColumn {
  std::size_t component;                   ///< 0 to 2: force x to z; 3 to 5: moment x to z
  std::optional<std::size_t> coefficient;  ///< the column is the derivative by this coefficient; none: the load itself
  std::vector<double> values;              ///< [step of the motion's grid] N or N m, over the coefficient's unit
};

/// The columns of the file but t_s, in its order, interpolated to the grid of the motion; without its low-pass.
/// `from_s`, `to_s`: the time common to motion capture and commands. io::InputError with file and line if the file is
/// not a prediction of this vehicle for this flight.
std::vector<PredictedColumn> read_predicted_loads(const std::filesystem::path& file, const model::BeatAveraged& vehicle,
                                                  const flightlog::BeatAveragedMotion& motion, double from_s,
                                                  double to_s);

}  // namespace flappy::gap
