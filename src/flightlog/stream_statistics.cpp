#include "flightlog/stream_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "io/statistics.hpp"

namespace flappy::flightlog {

StreamStatistics stream_statistics(const std::string& name, const Column& t_s, std::optional<double> declared_hz) {
  StreamStatistics s;
  s.name = name;
  s.samples = t_s.size();
  s.duration_s = t_s.back() - t_s.front();
  s.declared_hz = declared_hz;
  std::vector<double> intervals, pairs;
  for (std::size_t i = 1; i < t_s.size(); ++i) intervals.push_back(t_s[i] - t_s[i - 1]);
  for (std::size_t i = 2; i < t_s.size(); ++i) pairs.push_back((t_s[i] - t_s[i - 2]) / 2);
  const double usual = io::upper_median(pairs.empty() ? intervals : pairs);
  double sum = 0, squares = 0, count = 0;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const double dt = intervals[i];
    s.longest_gap_s = std::max(s.longest_gap_s, dt);
    // Count with the shorter neighbour: a late sample makes one long and one short interval, but none is missing.
    const double before = i > 0 ? intervals[i - 1] : usual, after = i + 1 < intervals.size() ? intervals[i + 1] : usual;
    const long missing = dt > 1.5 * usual ? std::lround((dt + std::min(before, after)) / usual) - 2 : 0;
    if (missing > 0) {
      if (declared_hz) s.missing += static_cast<std::size_t>(missing);
    } else {
      sum += dt, squares += dt * dt, ++count;
    }
  }
  s.jitter_s = std::sqrt(std::max(squares / count - (sum / count) * (sum / count), 0.0));
  s.rate_hz = static_cast<double>(s.samples + s.missing - 1) / s.duration_s;
  return s;
}

}  // namespace flappy::flightlog
