#pragma once

#include "gap/answer/inference.hpp"
#include "lab/benchmark/predict/predict.hpp"

namespace flappy::benchmark {

/// The simpler method that a diagnosis has to beat: it names the hypothesis, of those fitted by simulation, that leaves
/// least of the flights, in units of the noise; no evidence, no prior. In a contrast, residuals are those of
/// flights held out, which references predict.
Baseline best_rmse(const gap::Flights& flights, const gap::Inference& inference);

}  // namespace flappy::benchmark
