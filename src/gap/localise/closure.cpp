#include "gap/localise/closure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

/// Beats in a block that is resampled. Choice: a quarter of a second at 34 Hz.
constexpr std::size_t kBlock = 8;
/// Number of resamples for the interval of the closure. Choice.
constexpr int kDraws = 400;
/// The gap that can be closed has to be this many of its standard deviations. Choice.
constexpr double kMinGapSd = 2;

}  // namespace

double huber_loss(double z) {
  const double a = std::abs(z);
  return a <= kHuber ? a * a / 2 : kHuber * a - kHuber * kHuber / 2;
}

double huber_floor() {
  // 1/2 int_-k^k z^2 phi + 2 int_k^oo (k z - k^2/2) phi, with int_-k^k z^2 phi = 1 - 2 tail - 2 k phi(k)
  const double k = kHuber, tail = std::erfc(k / std::numbers::sqrt2) / 2;
  const double density = std::exp(-k * k / 2) / std::sqrt(2 * std::numbers::pi);
  return 0.5 - tail - k * density + 2 * k * density - k * k * tail;
}

std::optional<double> Losses::mean(std::optional<bool> on_bench) const {
  double s = 0, n = 0;
  for (std::size_t i = 0; i < sum.size(); ++i)
    if (!on_bench || (clamped[i] != 0) == *on_bench) s += sum[i], n += count[i];
  if (!(n > 0)) return std::nullopt;
  return s / n;
}

Losses losses_of(const RowContext& around, const TestResiduals& residual) {
  Losses l;
  for (std::size_t f = 0; f < around.beats.size(); ++f) {
    if (residual.size() <= f || residual[f].empty()) return {};
    for (std::size_t j = 0; j < around.beats[f]; ++j) {
      if (j % kBlock == 0) l.sum.push_back(0), l.count.push_back(0), l.clamped.push_back(around.clamped[f]);
      for (int channel = 0; channel < kChannels; ++channel) {
        if (!around.covers(f, j, channel)) continue;
        double sum = 0, n = 0;
        for (int c = 0; c < kCoefficients; ++c) {
          if (!around.has_rows(channel, c)) continue;
          const std::size_t g = group_of(channel, c);
          sum += huber_loss(residual[f][j * kRowsPerBeat + g] / around.noise_sd_of(around.clamped[f] != 0, channel, c));
          n += 1;
        }
        l.sum.back() += sum / n;
        l.count.back() += 1;
      }
    }
  }
  return l;
}

double sd_of_difference(const Losses& a, const Losses& b) {
  if (a.sum.size() != b.sum.size() || a.sum.size() < 2) return 0;
  const auto total = [](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); };
  const double rows = total(a.count), n = static_cast<double>(a.sum.size());
  const double mean = (total(a.sum) - total(b.sum)) / rows;
  double scatter = 0;
  for (std::size_t i = 0; i < a.sum.size(); ++i) {
    const double d = a.sum[i] - b.sum[i] - mean * a.count[i];
    scatter += d * d;
  }
  return std::sqrt(scatter * n / (n - 1)) / rows;
}

std::optional<Closure> closure_of(const Losses& refit, const Losses& effect, double floor) {
  const std::optional<double> before = refit.mean(), after = effect.mean();
  if (!before || !after) return std::nullopt;
  std::mt19937_64 random(1);
  std::vector<double> gaps, closures;
  for (int draw = 0; draw < kDraws; ++draw) {
    double e_refit = 0, e_effect = 0, n = 0;
    for (std::size_t i = 0; i < refit.sum.size(); ++i) {
      const std::size_t b = random() % refit.sum.size();
      e_refit += refit.sum[b], e_effect += effect.sum[b], n += refit.count[b];
    }
    if (!(n > 0)) continue;
    e_refit /= n, e_effect /= n;
    gaps.push_back(e_refit);
    closures.push_back((e_refit - e_effect) / (e_refit - floor));
  }
  double mean = 0, square = 0;
  for (const double g : gaps) mean += g / static_cast<double>(gaps.size());
  for (const double g : gaps) square += (g - mean) * (g - mean) / static_cast<double>(gaps.size());
  if (!(*before - floor >= kMinGapSd * std::sqrt(square)) || !(*before > floor)) return std::nullopt;
  return Closure{(*before - *after) / (*before - floor), io::quantile(closures, 0.05), io::quantile(closures, 0.95)};
}

}  // namespace flappy::gap
