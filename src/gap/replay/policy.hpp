// How a diagnosis treats a kind of vehicle. A vehicle of wings and motors predicts each harmonic of a beat, and models of its wings are never
// exact. A beat-averaged vehicle predicts means alone; what no effect explains of them is noise.
#pragma once

namespace flappy::gap {

struct DiagnosisPolicy {
  bool flight_offsets;  ///< the regime basis has an offset for each flight but the first
  bool
      discrepancy_scales;  ///< scales of the model discrepancy and of background magnitudes are fitted for each hypothesis
  bool nuisances_are_noise;  ///< what nuisance regressors explain is taken off residuals in flights held out
  bool move_parameters;      ///< parameters are fitted again jointly with the effects that explain most
  bool
      background_in_corrected;  ///< the corrected vehicle is fitted without background magnitudes by simulation, not by its columns
  bool validate;                ///< ladder, controls and agreements are computed; effects that cannot show are listed
  double min_step_nats;  ///< evidence that a step of a fit has to bring
  int max_further;       ///< effects that are tried jointly with the most probable set at a time
};

/// Of vehicles with wings and motors: steps have to be flown.
inline constexpr DiagnosisPolicy kWingPolicy{true, true, true, true, true, false, 0.5, 2};
/// Of beat-averaged vehicles: steps cost nothing.
inline constexpr DiagnosisPolicy kBeatAveragedPolicy{false, false, false, false, false, true, 0.05, 1};

}  // namespace flappy::gap
