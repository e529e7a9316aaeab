// Baselines: simpler methods that name an effect, which a diagnosis has to beat. All use the flights, the fitted parameters and the noise of the
// diagnosis. A column is the change of the residuals with one magnitude, from 0, or with one parameter, in units of the noise.
//   largest_residual  finds the channel and harmonic whose residual exceeds the noise most after the parameters are fitted, and names the effect
//                     whose prior magnitude changes these most. No name if no residual is twice the noise.
//   best_rmse         names the hypothesis that leaves the least residual, among those fitted by simulation; without evidence or prior
//   stlsq             sequentially thresholded least squares of the residual on the columns of all effects and parameters (Brunton,
//                     Proctor, Kutz, PNAS 113, 2016); parameters are never thresholded; the threshold is the one that
//                     predicts left-out flights best
//   black_box         ridge regression on features(), learnt on scored robots of other families (benchmark/black_box.hpp)
#pragma once

#include <Eigen/Dense>

#include "benchmark/predict/predict.hpp"
#include "gap/diagnose/inference.hpp"

namespace flappy::benchmark {

/// Answers of all baselines but black_box, by name.
std::map<std::string, Baseline> baselines(const gap::Flights& flights, const sim::Randomisation& uncertain,
                                          const gap::Inference& inference, const std::vector<std::string>& withheld,
                                          int threads);

/// Features of the residual of the fitted parameters, each as log(1 + x): the rms of each coefficient of each channel, in units of the noise; then,
/// for the mean and the first harmonic, the correlation with each function of the regime, over the standard deviation that noise would have.
std::vector<double> features(const gap::Flights& flights, const gap::Inference& inference);

/// A linear regression of the residual on columns.
struct Regression {
  std::vector<std::string> effects;   ///< [column]; "": a parameter, which is never thresholded
  std::vector<Eigen::MatrixXd> sums;  ///< [flight] sums of products of the columns and, last, the residual; square
  std::vector<double> rows;           ///< [flight] number of rows
};

/// The effects that are not thresholded, by their rms contribution, the largest first.
Baseline stlsq(const Regression& regression);

}  // namespace flappy::benchmark
