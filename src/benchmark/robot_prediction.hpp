// Reset predictions by a blind robot, like those of our simulator (gap/replay/reset_prediction.hpp): the recorded voltages drive it, and its torso
// is reset to the record at every interval of the IMU; wings, currents, heat and all its other states evolve by its own dynamics. So the difference
// of the predictions of two robots shows only the difference of the robots.
#pragma once

#include <vector>

#include "blind/a/robot.hpp"
#include "gap/evidence/evidence.hpp"

namespace flappy::benchmark {

/// A robot that differs from the one that flew.
struct Perturbation {
  model::Vehicle vehicle;
  blind::Magnitudes magnitudes;
  std::uint64_t seed = 0;
};

/// Rows (gap/replay/reset_prediction.hpp) that the sensors of a perturbed robot would have measured without noise in flight `flight` of its case:
/// torques and forces; all other channels 0. Empty if its simulation diverges.
gap::Rows predict_perturbed(const gap::PredictedFlight& recorded, const Perturbation& perturbation,
                            std::uint64_t flight);

/// predict_perturbed for all flights and perturbations, [perturbation][flight]; empty for a perturbation whose simulation diverges in any flight.
/// `threads`: 0: one for each processor; the result does not depend on it.
std::vector<gap::Residuals> predict_perturbed_flights(const gap::Flights& flights,
                                                      const std::vector<Perturbation>& perturbations, int threads);

}  // namespace flappy::benchmark
