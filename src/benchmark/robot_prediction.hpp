// Reset predictions by a blind robot, like ours (gap/replay/reset_prediction.hpp): recorded voltages drive it, its
// torso is reset at every interval of the IMU, all else evolves. So predictions of two robots differ only by the
// robots.
#pragma once

#include <vector>

#include "blind/a/robot.hpp"
#include "gap/evidence/evidence.hpp"

namespace flappy::benchmark {

struct Perturbation {
  model::Vehicle vehicle;
  blind::Magnitudes magnitudes;
  std::uint64_t seed = 0;
};

/// Rows of flight `flight` that a perturbed robot would give without noise: torques and forces; other channels 0. Empty
/// if its simulation diverges.
gap::Rows predict_perturbed(const gap::PredictedFlight& recorded, const Perturbation& perturbation,
                            std::uint64_t flight);

/// predict_perturbed for all, [perturbation][flight]; empty for a perturbation that diverges in any flight. `threads`:
/// 0: one for each processor; the result does not depend on it.
std::vector<gap::Residuals> predict_perturbed_flights(const gap::Flights& flights,
                                                      const std::vector<Perturbation>& perturbations, int threads);

}  // namespace flappy::benchmark
