// Reset predictions by the blind robot, as gap/replay/reset_prediction.hpp makes them by the simulator: under the recorded
// voltages, with the torso reset to the record at every interval of the IMU, while wings, currents, heat and whatever else it
// has stay its own. Two robots that predict one record differ by nothing but what they are.
#pragma once

#include <vector>

#include "blind/a/robot.hpp"
#include "gap/evidence/evidence.hpp"

namespace flappy::benchmark {

/// A robot that differs from the one that flew.
struct Perturbation {
  model::Vehicle vehicle;
  blind::Sizes sizes;
  std::uint64_t seed = 0;
};

/// As the sensors of a perturbed robot would have shown flight `flight` of its case, noise-free, in the rows of gap/replay/reset_prediction.hpp: torques
/// and forces, the rest 0. Empty where it comes apart.
gap::Rows predict_perturbed(const gap::PredictedFlight& recorded, const Perturbation& perturbation,
                            std::uint64_t flight);

/// All flights under all perturbations: [perturbation][flight]; empty residuals for those that come apart. The same for any number of
/// threads; 0: one for each processor.
std::vector<gap::Residuals> predict_perturbed_flights(const gap::Flights& flights,
                                                      const std::vector<Perturbation>& perturbations, int threads);

}  // namespace flappy::benchmark
