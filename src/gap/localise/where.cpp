#include "gap/localise/where.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gap/localise/significance.hpp"
#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

/// Beats in a block of the tests of means and slopes. Choice: half a second at 34 Hz, longer than noise is usually
/// correlated.
constexpr int kLongBlock = 16;
/// Beats in a block of the test of whiteness. Choice: short, yet longer than the hat of a beat
/// (gap/replay/beat_rows.hpp).
constexpr int kShortBlock = 8;
/// Largest memory of one beat in the frequency test. Choice.
constexpr double kMaxMemory = 0.95;
/// Upper ends of the frequency bands, except the highest band. Choice.
constexpr double kBandEnds_Hz[] = {0.5, 1, 2, 4, 8};

/// Weight of the square of a coefficient in the mean square of the waveform.
double share_of(int coefficient) { return coefficient == 0 ? 1 : 0.5; }

/// Share of autoregressive noise's variance below a frequency: integral of (1 - past^2) / |1 - past exp(i pi f)|^2.
/// `frequency`: over half the rate of beats; `past`: autocorrelation over a beat.
double share_below(double frequency, double past) {
  if (frequency >= 1) return 1;
  return 2 / std::numbers::pi * std::atan((1 + past) / (1 - past) * std::tan(std::numbers::pi / 2 * frequency));
}

struct TestedBeat {
  std::size_t flight, beat;
};

class ChannelRows {
 public:
  /// `clamped`: takes rows from runs on a bench alone, else from flights alone.
  ChannelRows(const RowContext& around, const TestResiduals& residual, int channel, bool clamped, Fitted fitted)
      : around_(around), channel_(channel), clamped_(clamped), fitted_(fitted) {
    const std::vector<int> all = blocks_of(around.beats, kLongBlock), fine = blocks_of(around.beats, kShortBlock);
    std::size_t i = 0;
    for (std::size_t f = 0; f < around.beats.size(); ++f)
      for (std::size_t j = 0; j < around.beats[f]; ++j, ++i)
        if (!residual[f].empty() && (around.clamped[f] != 0) == clamped && around.covers(f, j, channel)) {
          beats_.push_back({f, j});
          block_.push_back(all[i]);
          short_block_.push_back(fine[i]);
        }
    for (int c = 0; c < kCoefficients; ++c) {
      rows_.emplace_back();
      for (const TestedBeat& b : beats_)
        rows_.back().push_back(residual[b.flight][b.beat * kRowsPerBeat + group_of(channel, c)]);
    }
  }

  void test_all(std::vector<ResidualLocation>& places) const {
    if (beats_.empty()) return;
    const std::vector<double> all(beats_.size(), 1);
    add_cell(ResidualTest::channel, {}, all, 0, kCoefficients, places);
    for (const Quantity& q : around_.regimes) test_thirds(q, places);
    if (around_.has_rows(channel_, 1))
      for (int h = 0; h <= kHarmonics; ++h)
        add_cell(ResidualTest::phase, {"harmonic", Regime::Third::all, h, h, ""}, all, h == 0 ? 0 : 2 * h - 1,
                 h == 0 ? 1 : 2 * h + 1, places);
    test_bands(places);
    for (const Quantity& q : around_.inputs) test_input(q, places);
    test_whiteness(places);
  }

 private:
  double noise_sd(int coefficient) const { return around_.noise_sd_of(clamped_, channel_, coefficient); }
  void add(ResidualTest test, Regime regime, double gap, double floor, double p,
           std::vector<ResidualLocation>& places) const {
    places.push_back(
        {fitted_, test, channel_name(channel_), channel_unit(channel_), std::move(regime), gap, floor, p, false});
  }

  /// Tests the coefficients from `first` to before `last`, in the beats where `in` is 1.
  void add_cell(ResidualTest test, Regime regime, const std::vector<double>& in, int first, int last,
                std::vector<ResidualLocation>& places) const {
    double squares = 0, noise = 0, n = 0, least_p = 1;
    int tests = 0;
    for (const double i : in) n += i;
    for (int c = first; c < last; ++c) {
      if (!around_.has_rows(channel_, c)) continue;
      const std::vector<double>& y = rows_[static_cast<std::size_t>(c)];
      for (std::size_t i = 0; i < y.size(); ++i) squares += share_of(c) * in[i] * y[i] * y[i] / n;
      noise += share_of(c) * noise_sd(c) * noise_sd(c);
      const auto slope = slope_test(in, y, block_);
      if (!slope) return;
      least_p = std::min(least_p, slope->p_value);
      ++tests;
    }
    add(test, std::move(regime), std::sqrt(squares), std::sqrt(noise), std::min(1.0, tests * least_p), places);
  }

  std::vector<double> of(const Quantity& q) const {
    std::vector<double> x;
    for (const TestedBeat& b : beats_) x.push_back(q.values[b.flight][b.beat]);
    return x;
  }

  void test_thirds(const Quantity& q, std::vector<ResidualLocation>& places) const {
    const std::vector<double> x = of(q);
    std::vector<double> sorted = x;
    std::ranges::sort(sorted);
    const double first = sorted[sorted.size() / 3], last = sorted[2 * sorted.size() / 3];
    if (!(sorted.front() < first && first < last && last < sorted.back())) return;
    const Regime thirds[] = {{q.name, Regime::Third::low, {}, first, q.unit},
                             {q.name, Regime::Third::middle, first, last, q.unit},
                             {q.name, Regime::Third::high, last, {}, q.unit}};
    for (int third = 0; third < 3; ++third) {
      std::vector<double> in;
      for (const double v : x) in.push_back((v < first ? 0 : v < last ? 1 : 2) == third ? 1 : 0);
      add_cell(ResidualTest::regime, thirds[third], in, 0, kCoefficients, places);
    }
  }

  /// Autocorrelation of the noise over a beat, within blocks, less each block's mean, as slow changes are not noise;
  /// corrected for the bias in short blocks (Kendall 1954).
  double memory() const {
    std::vector<double> sums(1, 0), counts(1, 0);
    const std::vector<double>& y = rows_[0];
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < y.size(); ++i) {
      if (i > 0 && block_[i] != block_[i - 1]) sums.push_back(0), counts.push_back(0);
      sums.back() += y[i], counts.back() += 1;
      index.push_back(sums.size() - 1);
    }
    const auto off = [&](std::size_t i) { return y[i] - sums[index[i]] / counts[index[i]]; };
    double products = 0, squares = 0;
    for (std::size_t i = 1; i < y.size(); ++i) {
      if (index[i] != index[i - 1] || beats_[i].beat != beats_[i - 1].beat + 1) continue;
      products += off(i) * off(i - 1);
      squares += (off(i) * off(i) + off(i - 1) * off(i - 1)) / 2;
    }
    if (!(squares > 0)) return 0;
    return std::clamp((products / squares + 1.0 / kLongBlock) / (1 - 3.0 / kLongBlock), -kMaxMemory, kMaxMemory);
  }

  void test_bands(std::vector<ResidualLocation>& places) const {
    std::vector<double> ends(std::begin(kBandEnds_Hz), std::end(kBandEnds_Hz));
    const double highest_Hz = *std::ranges::max_element(around_.beats_Hz) / 2;
    std::erase_if(ends, [&](double end) { return end >= highest_Hz; });
    ends.push_back(highest_Hz);
    const double past = memory();
    Bands rest;
    std::vector<double> noise(ends.size(), 0);  // [band] mean square of autoregressive noise of variance 1
    for (std::size_t f = 0; f < around_.beats.size(); ++f) {
      std::vector<double> y(around_.beats[f], 0);
      double covered = 0;
      for (const TestedBeat& b : beats_)
        if (b.flight == f) y[b.beat] = rows_[0][static_cast<std::size_t>(&b - beats_.data())], covered += 1;
      if (covered == 0) continue;
      add_bands(y, around_.beats_Hz[f], ends, rest);
      double from = 0;
      for (std::size_t b = 0; b < ends.size(); ++b) {
        const double to = std::min(1.0, 2 * ends[b] / around_.beats_Hz[f]);
        noise[b] += (share_below(to, past) - share_below(from, past)) * covered / static_cast<double>(beats_.size());
        from = to;
      }
    }
    const std::size_t highest = ends.size() - 1;
    if (!(rest.power[highest] > 0)) return;
    const double scale = rest.power[highest] / noise[highest];
    for (std::size_t b = 0; b < highest; ++b)
      if (rest.bins[b] > 0)
        add(ResidualTest::frequency, {"frequency", Regime::Third::all, b == 0 ? 0 : ends[b - 1], ends[b], "Hz"},
            std::sqrt(rest.power[b] / static_cast<double>(beats_.size())), noise_sd(0) * std::sqrt(noise[b]),
            io::f_tail(rest.power[b] / noise[b] / scale, 2 * static_cast<double>(rest.bins[b]),
                       2 * static_cast<double>(rest.bins[highest])),
            places);
  }

  void test_input(const Quantity& q, std::vector<ResidualLocation>& places) const {
    std::vector<double> x = of(q);
    const double n = static_cast<double>(x.size());
    double mean = 0, square = 0;
    for (const double v : x) mean += v / n;
    for (double& v : x) v -= mean, square += v * v / n;
    if (!(square > 1e-18 * mean * mean)) return;
    double explained = 0, noise = 0, least_p = 1;
    int tests = 0;
    for (int c = 0; c < kCoefficients; ++c) {
      if (!around_.has_rows(channel_, c)) continue;
      std::vector<double> y = rows_[static_cast<std::size_t>(c)];
      double offset = 0;
      for (const double v : y) offset += v / n;
      for (double& v : y) v -= offset;
      const auto slope = slope_test(x, y, block_);
      if (!slope) return;
      explained += share_of(c) * slope->slope * slope->slope * square;
      noise += share_of(c) * noise_sd(c) * noise_sd(c) / n;
      least_p = std::min(least_p, slope->p_value);
      ++tests;
    }
    add(ResidualTest::input, {q.name, Regime::Third::all, {}, {}, ""}, std::sqrt(explained), std::sqrt(noise),
        std::min(1.0, tests * least_p), places);
  }

  void test_whiteness(std::vector<ResidualLocation>& places) const {
    if (channel_ >= kPathX) return;
    if (const auto w = whiteness_test(rows_[0], short_block_))
      add(ResidualTest::whiteness, {"block", Regime::Third::all, {}, kShortBlock, "beats"}, w->rms,
          noise_sd(0) / std::sqrt(double{kShortBlock}), w->p_value, places);
  }

  const RowContext& around_;
  int channel_;
  bool clamped_;
  Fitted fitted_;
  std::vector<TestedBeat> beats_;
  std::vector<int> block_, short_block_;
  std::vector<std::vector<double>> rows_;  ///< [coefficient][beat]
};

}  // namespace

RowContext row_context_of(const FlightList& flights, std::vector<double> noise_sd) {
  RowContext s;
  s.noise_sd = std::move(noise_sd);
  for (const auto& f : flights) {
    s.beats.push_back(f->beats());
    s.beats_Hz.push_back(f->beats_Hz());
    s.clamped.push_back(f->clamped() ? 1 : 0);
    s.covered.emplace_back();
    for (std::size_t j = 0; j < f->beats(); ++j)
      for (int channel = 0; channel < kChannels; ++channel) s.covered.back().push_back(f->covers(j, channel) ? 1 : 0);
  }
  for (int channel = 0; channel < kChannels; ++channel)
    for (int c = 0; c < kCoefficients; ++c)
      s.rows.push_back(std::ranges::any_of(flights, [&](const auto& f) { return f->has_rows(channel, c); }) ? 1 : 0);
  const auto gather = [&](std::vector<RegimeQuantity> (PredictedFlight::*of)() const, std::vector<Quantity>& to) {
    for (const auto& f : flights)
      for (RegimeQuantity& own : ((*f).*of)()) {
        auto at = std::ranges::find(to, own.name, &Quantity::name);
        if (at == to.end()) at = to.insert(at, {own.name, own.unit, {}});
        at->values.push_back(std::move(own.values));
      }
    std::erase_if(to, [&](const Quantity& q) { return q.values.size() < flights.size(); });
  };
  gather(&PredictedFlight::regimes, s.regimes);
  gather(&PredictedFlight::inputs, s.inputs);
  return s;
}

std::vector<ResidualLocation> locate(const RowContext& around, const TestResiduals& residual, Fitted fitted) {
  std::vector<ResidualLocation> places;
  for (const bool clamped : {false, true})
    for (int channel = 0; channel < kChannels; ++channel)
      ChannelRows(around, residual, channel, clamped, fitted).test_all(places);
  std::vector<double> p_values;
  for (const ResidualLocation& p : places) p_values.push_back(p.p_value);
  const std::vector<char> found = discoveries(p_values, kFalseDiscoveries);
  for (std::size_t i = 0; i < places.size(); ++i) places[i].discovered = found[i] != 0;
  return places;
}

}  // namespace flappy::gap
