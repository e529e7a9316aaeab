// Baselines: simpler methods that name an effect, which a diagnosis has to beat. They use its flights, fitted
// parameters and noise. A column is the change by one magnitude, from 0, or one parameter, over the noise.
//   largest_residual  names the effect whose prior magnitude most changes the channel and harmonic that exceed noise
//                     most after parameters are fitted; none if no residual is twice the noise
//   best_rmse         names the hypothesis, fitted by simulation, with the least residual; no evidence, no prior
//   stlsq             sequentially thresholded least squares on all effects and parameters (Brunton, Proctor, Kutz,
//                     PNAS 113, 2016); parameters stay; the threshold predicts left-out flights best
//   black_box         ridge regression on features(), learnt on other families' robots (black_box.hpp)
#pragma once

#include <Eigen/Dense>

#include "benchmark/predict/predict.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::benchmark {

/// Answers of all baselines but black_box, by name. `flights`: without references. In a contrast, residuals are what is
/// left given what the references show: Inference::refit.
std::map<std::string, Baseline> baselines(const gap::Flights& flights, const sim::Randomisation& uncertain,
                                          const gap::Inference& inference, const std::vector<std::string>& withheld,
                                          int threads);

/// Features of the residual of the fitted parameters, each as log(1 + x): the rms of each coefficient over the noise;
/// for mean and first harmonic, the correlation with each function of the regime over its standard deviation by noise.
std::vector<double> features(const gap::Flights& flights, const gap::Inference& inference);

struct Regression {
  std::vector<std::string> effects;   ///< [column]; "": a parameter, which is never thresholded
  std::vector<Eigen::MatrixXd> sums;  ///< [flight] sums of products of the columns and, last, the residual; square
  std::vector<double> rows;           ///< [flight] number of rows
};

/// Names the effects that are not thresholded, by their rms contribution, the largest first.
Baseline stlsq(const Regression& regression);

}  // namespace flappy::benchmark
