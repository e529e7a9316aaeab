#include "lab/benchmark/score_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "io/statistics.hpp"

namespace flappy::benchmark {
namespace {

constexpr std::size_t kResamples = 2000, kBins = 10;

/// The same on every platform, unlike the standard library's distributions.
class Draws {
 public:
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  std::size_t below(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(uniform() * static_cast<double>(n)));
  }

 private:
  std::mt19937_64 engine_{1};
};

/// E |N(d, s)|.
double folded_normal_mean(double d, double s) {
  if (!(s > 0)) return std::abs(d);
  const double z = d / s;
  return s * std::sqrt(2 / std::numbers::pi) * std::exp(-z * z / 2) + d * std::erf(z / std::numbers::sqrt2);
}

/// Calibration error with its bias removed; may be negative.
double unbiased_error(std::vector<Claim> claims) {
  std::ranges::sort(claims, {}, &Claim::probability);
  const std::size_t n = claims.size(), bins = std::min(n, kBins);
  std::vector<double> right(n);  // share of right claims among those of the same probability
  for (std::size_t i = 0, end = 0; i < n; i = end) {
    double sum = 0;
    for (end = i; end < n && claims[end].probability == claims[i].probability; ++end) sum += claims[end].right ? 1 : 0;
    std::fill(right.begin() + static_cast<std::ptrdiff_t>(i), right.begin() + static_cast<std::ptrdiff_t>(end),
              sum / static_cast<double>(end - i));
  }
  double error = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t from = b * n / bins, to = (b + 1) * n / bins;
    const double count = static_cast<double>(to - from);
    double stated = 0, share = 0;
    for (std::size_t i = from; i < to; ++i) stated += claims[i].probability / count, share += right[i] / count;
    const double d = stated - share, s = std::sqrt(std::max(0.0, share * (1 - share)) / count);
    error += count * (2 * std::abs(d) - folded_normal_mean(d, s));
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

double calibration_error(const std::vector<Claim>& claims) { return std::max(0.0, unbiased_error(claims)); }

ScoreValue calibration_score(const std::vector<Claim>& claims) {
  if (claims.empty()) return {};
  ScoreValue score{calibration_error(claims), 0, 0, claims.size()};
  Draws draws;
  std::vector<double> values;
  std::vector<Claim> some(claims.size());
  for (std::size_t k = 0; k < kResamples; ++k) {
    for (Claim& c : some) c = claims[draws.below(claims.size())];
    values.push_back(unbiased_error(some));
  }
  const double mean = io::mean(values);
  score.low = std::max(0.0, *score.value + io::quantile(values, 0.025) - mean);
  score.high = std::max(0.0, *score.value + io::quantile(values, 0.975) - mean);
  return score;
}

namespace {

std::vector<double> ranks_of(const std::vector<double>& x) {
  std::vector<double> ranks;
  for (const double v : x) {
    double below = 0, equal = 0;
    for (const double other : x) below += other < v, equal += other == v;
    ranks.push_back(below + (equal - 1) / 2);
  }
  return ranks;
}

}  // namespace

std::optional<double> rank_correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const std::vector<double> a = ranks_of(x), b = ranks_of(y);
  const double middle = (static_cast<double>(x.size()) - 1) / 2;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - middle) * (b[i] - middle);
    aa += (a[i] - middle) * (a[i] - middle);
    bb += (b[i] - middle) * (b[i] - middle);
  }
  if (!(aa > 0 && bb > 0)) return std::nullopt;
  return ab / std::sqrt(aa * bb);
}

std::optional<double> area_under_curve(const std::vector<Claim>& claims) {
  double sum = 0, pairs = 0;
  for (const Claim& right : claims)
    for (const Claim& wrong : claims) {
      if (!right.right || wrong.right) continue;
      sum += right.probability > wrong.probability ? 1 : right.probability == wrong.probability ? 0.5 : 0;
      pairs += 1;
    }
  if (pairs == 0) return std::nullopt;
  return sum / pairs;
}

}  // namespace flappy::benchmark
