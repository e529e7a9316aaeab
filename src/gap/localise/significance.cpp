#include "gap/localise/significance.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

/// Smallest number of blocks for a test of whiteness. Choice.
constexpr std::size_t kMinWhiteness = 20;
/// Smallest number of effective blocks for a test of a mean or a slope. Choice.
constexpr double kMinBlocks = 5;

}  // namespace

std::vector<int> blocks_of(const std::vector<std::size_t>& beats, int length) {
  std::vector<int> block;
  int first = 0;
  for (const std::size_t n : beats) {
    for (std::size_t j = 0; j < n; ++j) block.push_back(first + static_cast<int>(j) / length);
    first += static_cast<int>(n) / length + kWhitenessLags + 2;
  }
  return block;
}

std::optional<FittedSlope> slope_test(const std::vector<double>& x, const std::vector<double>& y,
                                      const std::vector<int>& block) {
  double squares = 0, products = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += x[i] * x[i], products += x[i] * y[i];
  if (!(squares > 0)) return std::nullopt;
  FittedSlope s{products / squares, 1};
  std::map<int, double> sums, weights;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (x[i] != 0) sums[block[i]] += x[i] * (y[i] - s.slope * x[i]), weights[block[i]] += x[i] * x[i] / squares;
  double uneven = 0, alone = 0, neighbours = 0;
  for (const auto& [b, w] : weights) uneven += w * w;
  const double n = 1 / uneven;
  if (n < kMinBlocks) return std::nullopt;
  for (auto b = sums.begin(); b != sums.end(); ++b) {
    alone += b->second * b->second;
    const auto next = std::next(b);
    if (next != sums.end() && next->first == b->first + 1) neighbours += b->second * next->second;
  }
  const double variance = n / (n - 1) * (alone + 2 * std::max(0.0, neighbours)) / (squares * squares);
  if (variance > 0) s.p_value = io::t_tail(s.slope / std::sqrt(variance), n - 1);
  else s.p_value = s.slope == 0 ? 1 : 0;
  return s;
}

std::optional<Whiteness> whiteness_test(const std::vector<double>& y, const std::vector<int>& block) {
  std::map<int, std::pair<double, double>> sums;
  for (std::size_t i = 0; i < y.size(); ++i) sums[block[i]].first += y[i], sums[block[i]].second += 1;
  if (sums.size() < kMinWhiteness) return std::nullopt;
  const double n = static_cast<double>(sums.size());
  double mean = 0, squares = 0;
  for (auto& [b, s] : sums) s.first /= s.second, mean += s.first / n;
  Whiteness w;
  for (auto& [b, s] : sums) {
    w.rms += s.first * s.first / n;
    s.first -= mean;
    squares += s.first * s.first;
  }
  w.rms = std::sqrt(w.rms);
  if (!(squares > 0)) return w;
  double q = 0;
  for (int lag = 1; lag <= kWhitenessLags; ++lag) {
    double products = 0;
    for (const auto& [b, s] : sums)
      if (const auto later = sums.find(b + lag); later != sums.end()) products += s.first * later->second.first;
    q += products * products / (squares * squares) / (n - lag);
  }
  w.p_value = io::chi2_tail(n * (n + 2) * q, kWhitenessLags);
  return w;
}

void add_bands(const std::vector<double>& y, double beats_Hz, const std::vector<double>& ends_Hz, Bands& to) {
  to.power.resize(ends_Hz.size(), 0);
  to.bins.resize(ends_Hz.size(), 0);
  const double n = static_cast<double>(y.size());
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double>().fwd(spectrum, y);
  for (std::size_t k = 1; k <= y.size() / 2; ++k) {
    const double hz = beats_Hz * static_cast<double>(k) / n;
    const auto band = static_cast<std::size_t>(std::ranges::lower_bound(ends_Hz, hz) - ends_Hz.begin());
    if (band >= ends_Hz.size()) break;
    to.power[band] += (2 * k == y.size() ? 1 : 2) * std::norm(spectrum[k]) / n;
    to.bins[band] += 1;
  }
}

std::vector<char> discoveries(const std::vector<double>& p_values, double rate) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return p_values[i]; });
  std::size_t found = 0;
  for (std::size_t i = 0; i < order.size(); ++i)
    if (p_values[order[i]] <= rate * static_cast<double>(i + 1) / static_cast<double>(order.size())) found = i + 1;
  std::vector<char> is(p_values.size(), 0);
  for (std::size_t i = 0; i < found; ++i) is[order[i]] = 1;
  return is;
}

}  // namespace flappy::gap
