// What a pilot would notice of a corrected vehicle: the steadiness, trim and drift of recorded flights, beside those of two
// simulated vehicles that fly the same path under a controller of ours.
//
// Every quantity is computed from a log in one way, whoever flew: pose and inputs are averaged over each wing beat; the path
// of a log is its beats' position and heading, fitted by a straight line around every instant with weights of a normal law
// of 0.25 s (half of a motion of 0.75 Hz passes).
//   mean_amplitude_V, mean_difference_V, mean_bias_V, mean_split_cycle     trim; read off the voltages as commanded, before
//                                                          the battery scales them
//   amplitude_rise_V       what thrust asks more for at the end: a line through the beats' amplitudes, over the whole flight
//   rms_roll_rad, rms_pitch_rad                            lean, its mean and all
//   rms_off_path_m         from the log's own path
//   yaw_drift_rad          heading of the last second less that of the first
#pragma once

#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "gap/result/diagnosis.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

struct ClosedLoopOptions {
  /// Fly the configuration's own path and excitation, on the clock that starts with the log's first command, and judge from
  /// its settle_s on. Else the recorded path is flown without excitation: where the robot hovered, the mean place and the
  /// first heading, elsewhere the log's path, each after some seconds of hover.
  bool own_path = false;
  std::size_t copies = 2;
  int threads = 0;
};

/// Rows of every flight in the order above. Predictions are means over copies with other noise. `pilot`: controller or actor, and sensors; its vehicle is not used.
std::vector<ClosedLoop> predict_closed_loop(const Flights& flights, const model::Vehicle& nominal,
                                            const model::Vehicle& corrected, const rollout::FlyConfig& pilot,
                                            const ClosedLoopOptions& options = {});

}  // namespace flappy::gap
