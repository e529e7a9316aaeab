// Closed-loop check of a corrected vehicle: compares steadiness, trim and drift of recorded flights with simulated flights of two vehicles, the
// one of the vehicle file and the corrected one, which fly the same path with a controller of ours.
//
// All quantities are computed from logs, in the same way for recorded and simulated flights. Pose and inputs are averaged over each wing beat.
// The path of a log is the position and heading of its beats, smoothed at each instant by a straight line with normal weights of standard
// deviation 0.25 s (half of a motion of 0.75 Hz passes).
//   mean_amplitude_V, mean_difference_V, mean_bias_V, mean_split_cycle     trim, computed from the voltages (BeatMotion)
//   amplitude_rise_V       rise of the amplitude over the flight, by a straight line through the amplitudes of the beats
//   rms_roll_rad, rms_pitch_rad                            about 0, so the mean lean counts
//   rms_off_path_m         distance from the log's own smoothed path
//   yaw_drift_rad          mean heading of the last second less that of the first
#pragma once

#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "gap/result/diagnosis.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

struct ClosedLoopOptions {
  /// true: simulations fly the path and excitation of the pilot's configuration, on the clock that starts with the log's first command, and both
  /// flights are evaluated from its settle_s on. false: simulations first hover some seconds, then fly without excitation: if the robot hovered, at
  /// its mean position and first heading; otherwise along the log's path.
  bool own_path = false;
  std::size_t copies = 2;
  int threads = 0;
};

/// For each flight, the quantities in the order above. Predictions are means over copies with different noise. `pilot`: controller or actor, and
/// sensors; its vehicle is not used.
std::vector<ClosedLoop> predict_closed_loop(const Flights& flights, const model::Vehicle& nominal,
                                            const model::Vehicle& corrected, const rollout::FlyConfig& pilot,
                                            const ClosedLoopOptions& options = {});

}  // namespace flappy::gap
