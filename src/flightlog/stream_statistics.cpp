#include "flightlog/stream_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <vector>

#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// How a stream's samples follow each other where none is missing.
struct Rhythm {
  double period_s;
  double shorter_s, longer_s;  ///< intervals within a bunch, and between bunches; both the period without bunches
  double share = 1;            ///< of the sequences as long as a bunch, those that have one pause
};

/// The most frequent interval: the middle of the fullest window of intervals, moved to the mean of those that are
/// neither halves nor multiples of it, because stamps with few digits make one interval two neighbouring values.
double most_frequent(std::vector<double> intervals) {
  constexpr double kWindow = 1.25;     // of its largest to its smallest interval; 2 would hold gaps
  constexpr double kAsFrequent = 0.9;  // ends of a table may cut off the shorter of two intervals
  constexpr double kHalf = 0.5, kSingle = 1.55;
  constexpr int kMoves = 5;
  std::ranges::sort(intervals);
  std::vector<std::size_t> counts;
  for (std::size_t i = 0, end = 0; i < intervals.size(); ++i) {
    while (end < intervals.size() && intervals[end] <= kWindow * intervals[i]) ++end;
    counts.push_back(end - i);
  }
  const double enough = kAsFrequent * static_cast<double>(*std::ranges::max_element(counts));
  const auto fullest = std::ranges::find_if(counts, [&](std::size_t n) { return static_cast<double>(n) >= enough; });
  const auto first = fullest - counts.begin();
  double middle = intervals[static_cast<std::size_t>(first) + *fullest / 2];
  for (int i = 0; i < kMoves; ++i) {
    const auto from = std::ranges::lower_bound(intervals, kHalf * middle),
               to = std::ranges::upper_bound(intervals, kSingle * middle);
    middle = io::mean(std::span(from, to));
  }
  return middle;
}

/// The rhythm of rows that come in bunches of `size`; nothing where they do not.
std::optional<Rhythm> bunches(const Column& t_s, const std::vector<double>& intervals, std::size_t size) {
  constexpr double kUnequal = 1.6;  // less may be two neighbouring values of stamps with few digits, as 2 and 3 ms
  if (intervals.size() < 2 * size) return std::nullopt;
  std::vector<double> sums;
  for (std::size_t i = size; i < t_s.size(); ++i) sums.push_back(t_s[i] - t_s[i - size]);
  const double whole = io::upper_median(sums), mean = whole / static_cast<double>(size);
  std::vector<double> within;
  std::ranges::copy_if(intervals, std::back_inserter(within), [&](double dt) { return dt <= mean; });
  if (within.empty()) return std::nullopt;
  const double shorter = io::upper_median(within), longer = whole - static_cast<double>(size - 1) * shorter;
  if (size == 2 ? longer < kUnequal * shorter : shorter > mean / 2) return std::nullopt;
  std::size_t with_one_pause = 0, alike = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto from = intervals.begin() + static_cast<std::ptrdiff_t>(i);
    const auto is_pause = [&](double dt) { return dt > mean; };
    with_one_pause += std::count_if(from, from + static_cast<std::ptrdiff_t>(size), is_pause) == 1;
    alike += std::abs(sums[i] - whole) < mean / 4;
  }
  // One pause have 2/3 of the pairs where each fourth sample is missing, and half of them where samples are lost at
  // random. A lost bunch makes another sum in `size` of them.
  const auto share = [&](std::size_t n) { return static_cast<double>(n) / static_cast<double>(sums.size()); };
  if (share(with_one_pause) < 0.8 || share(alike) < 0.5) return std::nullopt;
  return Rhythm{mean, shorter, longer, share(with_one_pause)};
}

Rhythm rhythm_of(const Column& t_s, const std::vector<double>& intervals) {
  constexpr std::size_t kLargestBunch = 16;
  std::optional<Rhythm> best;
  for (std::size_t size = 2; size <= kLargestBunch; ++size)
    if (const auto found = bunches(t_s, intervals, size); found && (!best || found->share > best->share)) best = found;
  if (best) return *best;
  const double period = most_frequent(intervals);
  return {period, period, period};
}

}  // namespace

StreamStatistics stream_statistics(const std::string& name, const Column& t_s, std::optional<double> declared_hz) {
  StreamStatistics s;
  s.name = name;
  s.samples = t_s.size();
  s.duration_s = t_s.back() - t_s.front();
  s.declared_hz = declared_hz;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < t_s.size(); ++i) intervals.push_back(t_s[i] - t_s[i - 1]);
  const auto [period, shorter, longer, share] = rhythm_of(t_s, intervals);
  double sum = 0, squares = 0, count = 0;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const double dt = intervals[i];
    s.longest_gap_s = std::max(s.longest_gap_s, dt);
    // A late sample makes one long and one short interval, but none is missing.
    const double before = i > 0 ? intervals[i - 1] : shorter,
                 after = i + 1 < intervals.size() ? intervals[i + 1] : shorter;
    const double beyond = dt - longer + std::min({before, after, shorter}) - shorter;
    const long missing = dt > longer + period / 2 ? std::lround(beyond / period) : 0;
    if (missing > 0) {
      if (declared_hz) s.missing += static_cast<std::size_t>(missing);
    } else {
      sum += dt, squares += dt * dt, ++count;
    }
  }
  s.jitter_s = count > 0 ? std::sqrt(std::max(squares / count - (sum / count) * (sum / count), 0.0)) : 0;
  s.rate_hz = static_cast<double>(s.samples + s.missing - 1) / s.duration_s;
  return s;
}

}  // namespace flappy::flightlog
