// Simpler ways to name an effect, which a diagnosis has to beat. All see the flights, the fitted parameters and the noise that the
// diagnosis found; a column is how residuals change with one size, from 0, or with one parameter, in units of the noise.
//   largest_residual  the channel and harmonic whose residual stands out most after the parameters are refitted; the effect whose
//                     prior size shows most there. No name where nothing is twice the noise.
//   best_rmse         of the effects that were fitted in full beside the parameters, the one that leaves least; no evidence, no prior
//   stlsq             sequentially thresholded least squares of the residual on the columns of all effects and parameters (Brunton,
//                     Proctor, Kutz, PNAS 113, 2016); parameters are never thresholded; the threshold is the one that
//                     predicts flights left out best
//   black_box         ridge regression on features(), learnt on scored robots of other families (benchmark/black_box.hpp)
#pragma once

#include <Eigen/Dense>

#include "benchmark/predict/predict.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::benchmark {

std::map<std::string, Baseline> baselines(const gap::Flights& flights, const sim::Randomisation& uncertain,
                                          const gap::Inference& inference, const std::vector<std::string>& withheld,
                                          int threads);

/// What the parameters leave, in logarithms: the rms of every channel and harmonic in units of the noise, and, of mean and first harmonic, how
/// much goes with each function of the regime, as correlation over what noise has.
std::vector<double> features(const gap::Flights& flights, const gap::Inference& inference);

/// A residual and what it may be a sum of.
struct Regression {
  std::vector<std::string> effects;   ///< [column]; empty: never thresholded
  std::vector<Eigen::MatrixXd> sums;  ///< [flight]: sums of products of columns, then the residual: square
  std::vector<double> rows;           ///< [flight]
};

/// Effects that are left, and their order by what they contribute.
Baseline stlsq(const Regression& regression);

}  // namespace flappy::benchmark
