// Closed-loop check of a corrected vehicle: compares steadiness, trim and drift of recorded flights with those of
// simulated flights. The vehicle file and the corrected vehicle fly the same path, with a controller of ours. Recorded
// and simulated logs are evaluated alike, from half a second after their first beat on. Pose and inputs are averaged
// over each beat. The path of a log is its position and heading, smoothed by local straight lines with Gaussian weights
// of standard deviation 0.25 s (half the amplitude of a 0.75 Hz motion passes). Simulations follow the recorded path,
// smoothed with half this standard deviation.
//   mean_amplitude_V, mean_difference_V, mean_bias_V, mean_split_cycle   trim, computed from the voltages (BeatMotion)
//   amplitude_rise_V       rise of a straight line through the amplitudes of the beats
//   rms_roll_rad, rms_pitch_rad                            about 0, not about the mean
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
  /// true: simulations fly path and excitation of the pilot's configuration. Logs are evaluated from its settle_s to
  /// its duration_s; in the recorded log, time counts from the first command. false: simulations first hover some
  /// seconds, then fly without excitation along the log's path or, if the robot hovered, at its mean position and first
  /// heading.
  bool own_path = false;
  std::size_t copies = 2;  ///< simulated flights of each vehicle for each recorded one
  int threads = 0;         ///< as for io::parallel_for
};

/// The quantities above for each flight, one flight after another. Predictions are means over copies with different
/// noise; NaN if one copy is lost, or a log has too few beats in the air. `flights`: test flights of a vehicle with
/// wings; `nominal`: the vehicle file. `pilot`: configuration with the controller and the sensors; its vehicle is not
/// used.
std::vector<ClosedLoop> predict_closed_loop(const FlightList& flights, const model::Vehicle& nominal,
                                            const model::Vehicle& corrected, const rollout::FlyConfig& pilot,
                                            const ClosedLoopOptions& options = {});

}  // namespace flappy::gap
