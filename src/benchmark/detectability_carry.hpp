// The blind robot carried along a recorded motion, as gap/carry.hpp carries the simulator: under the recorded voltages, its
// torso put back onto the record at every interval of the IMU, while wings, currents, heat and whatever else it has stay
// its own. Two robots carried along one record differ by nothing but what they are.
#pragma once

#include <vector>

#include "blind/robot.hpp"
#include "gap/evidence/evidence.hpp"

namespace flappy::benchmark {

/// What flies a recording once more.
struct Rider {
  model::Vehicle vehicle;
  blind::Sizes sizes;
  std::uint64_t seed = 0;
  int late_steps = 0;  ///< of gap::kStep_s, by which voltages arrive later
};

/// As the sensors of a rider would have shown flight `flight` of its case, noise-free, in the rows of gap/carry.hpp: torques
/// and forces, the rest 0. Empty where it comes apart.
gap::Rows carry(const gap::Recording& recording, const Rider& rider, std::uint64_t flight);

/// All flights under all riders: [rider][flight]; empty signatures for those that come apart. The same for any number of
/// threads; 0: one for each processor.
std::vector<gap::Signature> carry_all(const std::vector<gap::CarriedFlight>& flights, const std::vector<Rider>& riders,
                                      int threads);

}  // namespace flappy::benchmark
