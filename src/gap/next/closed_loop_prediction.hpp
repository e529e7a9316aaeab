// Closed-loop check of a corrected vehicle: steadiness, trim and drift of recorded flights, compared with simulated
// flights of the vehicle file and of the corrected vehicle, on the same path with a controller of ours.
// Recorded and simulated logs are evaluated alike, half a second after their first beat on. Pose and inputs are
// averaged over each beat. A log's path is its position and heading, smoothed by a straight line with normal weights of
// standard deviation 0.25 s (half of a 0.75 Hz motion passes); simulations follow it smoothed over half that time.
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
  /// true: simulations fly path and excitation of the pilot's configuration, on the clock of the log's first command;
  /// evaluated from its settle_s on. false: they first hover some seconds, then fly without excitation along the log's
  /// path or, if the robot hovered, at its mean position and first heading.
  bool own_path = false;
  std::size_t copies = 2;  ///< simulated flights of each vehicle for each recorded one
  int threads = 0;         ///< as for io::parallel_for
};

/// The quantities above of each flight, flight by flight. Predictions are means over copies with different noise; NaN
/// if one copy is lost, or a log has too few beats in the air. `flights`: test flights of a vehicle with wings;
/// `nominal`: the vehicle file. `pilot`: who flies, and with which sensors; its vehicle is not used.
std::vector<ClosedLoop> predict_closed_loop(const FlightList& flights, const model::Vehicle& nominal,
                                            const model::Vehicle& corrected, const rollout::FlyConfig& pilot,
                                            const ClosedLoopOptions& options = {});

}  // namespace flappy::gap
