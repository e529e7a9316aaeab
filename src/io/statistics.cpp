#include "io/statistics.hpp"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace flappy::io {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

double mean(std::span<const double> sample) {
  return std::accumulate(sample.begin(), sample.end(), 0.0) / static_cast<double>(sample.size());
}

double quantile(std::vector<double> sample, double share) {
  if (sample.empty()) return kNone;
  const double at = share * static_cast<double>(sample.size() - 1);
  const auto k = static_cast<std::size_t>(at);
  const auto place = sample.begin() + static_cast<std::ptrdiff_t>(k);
  std::ranges::nth_element(sample, place);
  const double low = *place, part = at - static_cast<double>(k);
  if (part == 0 || std::isinf(low)) return low;
  return low + part * (*std::min_element(place + 1, sample.end()) - low);
}

double median(std::vector<double> sample) { return quantile(std::move(sample), 0.5); }

double order_statistic(std::vector<double> sample, std::size_t k) {
  if (k >= sample.size()) return kNone;
  const auto place = sample.begin() + static_cast<std::ptrdiff_t>(k);
  std::ranges::nth_element(sample, place);
  return *place;
}

double upper_median(std::vector<double> sample) {
  const std::size_t middle = sample.size() / 2;
  return order_statistic(std::move(sample), middle);
}

Interval wilson_interval(std::size_t successes, std::size_t count) {
  if (count == 0) return {0, 1};
  constexpr double z = kNormal975;
  const double n = static_cast<double>(count), p = static_cast<double>(successes) / n;
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {successes == 0 ? 0 : middle - half, successes == count ? 1 : middle + half};
}

double t_tail(double t, double freedom) { return f_tail(t * t, 1, freedom); }

double f_tail(double f, double numerator_freedom, double denominator_freedom) {
  const double a = numerator_freedom, b = denominator_freedom;
  return boost::math::ibeta(b / 2, a / 2, b / (b + a * std::max(0.0, f)));
}

double chi2_tail(double x, double freedom) { return boost::math::gamma_q(freedom / 2, std::max(0.0, x) / 2); }

double chi2_quantile(double share, double freedom) { return 2 * boost::math::gamma_p_inv(freedom / 2, share); }

}  // namespace flappy::io
