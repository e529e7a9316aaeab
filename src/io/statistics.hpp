// Statistics of samples, and tails of distributions. Samples may hold infinities but not NaN. Statistics of an empty
// sample are NaN.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace flappy::io {

/// The 97.5 % quantile of the standard normal distribution: a 95 % interval reaches from minus to plus so
/// many standard deviations.
inline constexpr double kNormal975 = 1.959963984540054;

struct Interval {
  double low = 0, high = 0;
};

double mean(std::span<const double> sample);

/// Linear interpolation of order statistics x_1 <= ... <= x_n (type 7 of Hyndman and Fan, Am. Stat. 50, 1996):
/// x_k + (h - k) (x_{k+1} - x_k) with h = 1 + (n - 1) share and k = floor(h). All reported quantiles use this
/// convention.
double quantile(std::vector<double> sample, double share);
double median(std::vector<double> sample);

/// Element k of the sorted sample, counted from 0; NaN if k >= sample.size().
double order_statistic(std::vector<double> sample, std::size_t k);
/// The median, or the larger of the two middle values of an even number, so that it is always a value of the sample.
double upper_median(std::vector<double> sample);

/// 95 % interval of a probability after `successes` in `count` trials (Wilson, J. Am. Stat. Assoc. 22, 1927).
/// {0, 1} if count is 0.
Interval wilson_interval(std::size_t successes, std::size_t count);

double t_tail(double t, double freedom);  ///< P(|T| > |t|) of Student's t, two-sided
double f_tail(double f, double numerator_freedom, double denominator_freedom);  ///< P(F > f)
double chi2_tail(double x, double freedom);                                     ///< P(X > x)
double chi2_quantile(double share, double freedom);                             ///< the x with P(X < x) = share

}  // namespace flappy::io
