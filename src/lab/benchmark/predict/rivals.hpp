// Simple methods that a diagnosis has to beat. Each sees what the diagnosis sees, and says how strongly it means it; the score compares
// them at the diagnosis' own share of false alarms.
#pragma once

#include <Eigen/Dense>

#include "gap/answer/inference.hpp"
#include "lab/benchmark/predict/predict.hpp"

namespace flappy::benchmark {

/// Least error: the hypothesis, of those fitted by simulation, that leaves least of the flights in units of the noise; no evidence, no
/// prior. In a contrast, residuals are those of flights held out, which references predict. Its strength is the share by which it leaves
/// less than the parameters alone.
Rival best_rmse(const gap::Flights& flights, const gap::Inference& inference);

/// The same, but in the one group of rows alone (a channel and a coefficient of the beat) in which the parameters leave most.
Rival largest_residual(const gap::Flights& flights, const gap::Inference& inference);

/// Whether anything changed, without a name: a Hotelling test of the means of the four inputs of the wing beat over each flight, test flights
/// against references; its strength is 1 - p (Anderson, An Introduction to Multivariate Statistical Analysis, 3rd ed., 2003, sec. 5.3). With
/// fewer than six flights of such inputs it has no strength.
Rival hotelling(const gap::Flights& flights);

/// 1 - p of Hotelling's two-sample test of rows; 0 with fewer than six of both, or without either.
double hotelling_strength(const Eigen::MatrixX4d& references, const Eigen::MatrixX4d& tests);

}  // namespace flappy::benchmark
