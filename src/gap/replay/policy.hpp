// How a diagnosis treats a kind of vehicle. With wings and motors, each harmonic is predicted, and no wing model is
// exact. Beat-averaged: only means are predicted; what no effect explains counts as noise, but in a contrast.
#pragma once

namespace flappy::gap {

struct DiagnosisPolicy {
  bool flight_offsets;  ///< the regime basis has an offset for each flight but the first
  /// Scales of the model discrepancy and of background magnitudes are fitted for each hypothesis.
  bool discrepancy_scales;
  bool nuisances_are_noise;      ///< residuals of held-out flights exclude what the nuisance regressors explain
  bool move_parameters;          ///< parameters are fitted again jointly with the effects that explain most
  bool background_in_corrected;  ///< the corrected vehicle has effects with the fit's background magnitudes
  bool validate;                 ///< ladder, controls and agreements are computed; effects that cannot show are listed
  double min_step_nats;          ///< least gain of evidence for which a fit takes another step
  int max_further;               ///< number of effects that are tried at a time, each jointly with the best set
};

/// Vehicles with wings and motors: each step of a fit costs a simulation, so it has to bring more.
inline constexpr DiagnosisPolicy kWingPolicy{true, true, true, true, true, false, 0.5, 2};
/// Beat-averaged vehicles: a step of a fit costs almost nothing.
inline constexpr DiagnosisPolicy kBeatAveragedPolicy{false, false, false, false, false, true, 0.05, 1};
/// The same in a contrast: what a model gets wrong in both sessions cancels, and is no noise.
inline constexpr DiagnosisPolicy kBeatAveragedContrastPolicy{true, true, true, true, false, false, 0.05, 2};

}  // namespace flappy::gap
