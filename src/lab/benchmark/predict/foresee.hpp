#pragma once

#include <string>
#include <vector>

#include "lab/benchmark/predict/predict.hpp"

namespace flappy::benchmark {

/// A plan's expectation for the diagnosis of a case, if the robot has this effect.
struct Foreseen {
  std::string effect;
  std::string rival;       ///< the best one, by expected evidence
  double nats = 0;         ///< expected evidence for the effect over this rival
  double probability = 0;  ///< that the diagnosis gives the effect
};

/// The plan (gap/next/plan.hpp) of flights with the inputs and paths of the question's, of effects at their typical
/// magnitudes, on one thread. io::InputError for a file or log that is not accepted.
std::vector<Foreseen> foresee(const Question& question);

}  // namespace flappy::benchmark
