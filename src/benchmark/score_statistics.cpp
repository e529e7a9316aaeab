#include "benchmark/score_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "io/statistics.hpp"

namespace flappy::benchmark {
namespace {

constexpr std::size_t kResamples = 2000, kBins = 10;

/// The same draws every time, and wherever the program runs: no distribution of the standard library is.
class Draws {
 public:
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  std::size_t below(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(uniform() * static_cast<double>(n)));
  }

 private:
  std::mt19937_64 engine_{1};
};

/// Of claims in the order of their probability.
double error_of(const std::vector<Claim>& sorted) {
  const std::size_t n = sorted.size(), bins = std::min(n, kBins);
  double error = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    double difference = 0;
    for (std::size_t i = b * n / bins; i < (b + 1) * n / bins; ++i)
      difference += sorted[i].probability - (sorted[i].right ? 1 : 0);
    error += std::abs(difference);
  }
  return n > 0 ? error / static_cast<double>(n) : 0;
}

}  // namespace

ScoreValue proportion(std::size_t successes, std::size_t count) {
  if (count == 0) return {};
  const io::Interval interval = io::wilson_interval(successes, count);
  return {static_cast<double>(successes) / static_cast<double>(count), interval.low, interval.high, count};
}

ScoreValue resampled(std::size_t count,
                     const std::function<std::optional<double>(const std::vector<std::size_t>&)>& statistic) {
  std::vector<std::size_t> cases(count);
  for (std::size_t i = 0; i < count; ++i) cases[i] = i;
  ScoreValue score;
  if (count == 0 || !(score.value = statistic(cases))) return {};
  score.count = count;
  Draws draws;
  std::vector<double> values;
  for (std::size_t k = 0; k < kResamples; ++k) {
    for (std::size_t& c : cases) c = draws.below(count);
    if (const auto value = statistic(cases)) values.push_back(*value);
  }
  score.low = values.empty() ? *score.value : io::quantile(values, 0.025);
  score.high = values.empty() ? *score.value : io::quantile(values, 0.975);
  return score;
}

double calibration_error(std::vector<Claim> claims) {
  std::ranges::stable_sort(claims, {}, &Claim::probability);
  return error_of(claims);
}

double calibrated_error_95(std::vector<Claim> claims) {
  std::ranges::stable_sort(claims, {}, &Claim::probability);
  Draws draws;
  std::vector<double> errors;
  for (std::size_t k = 0; k < kResamples; ++k) {
    for (Claim& c : claims) c.right = draws.uniform() < c.probability;
    errors.push_back(error_of(claims));
  }
  return io::quantile(errors, 0.95);
}

}  // namespace flappy::benchmark
