#include "flightlog/readings.hpp"

#include <algorithm>
#include <cmath>

#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// No flapper turns or travels so far between two poses: markers were taken for others. They are so for some poses at most.
constexpr double kLeap_rad = 0.5, kLeap_rad_s = 40, kLeap_m = 0.05, kLeap_m_s = 10;
constexpr std::size_t kMostSwapped = 10;

bool leaps(const PoseReading& from, const PoseReading& to) {
  const double dt_s = std::abs(to.t_s - from.t_s);
  return from.attitude().angularDistance(to.attitude()) > kLeap_rad + kLeap_rad_s * dt_s ||
         (to.position_m - from.position_m).norm() > kLeap_m + kLeap_m_s * dt_s;
}

/// Without poses that leap away from those before, and back.
std::vector<PoseReading> without_swaps(const std::vector<PoseReading>& poses) {
  std::vector<PoseReading> kept;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!kept.empty() && leaps(kept.back(), poses[i])) {
      std::size_t back = i + 1;
      const std::size_t last = std::min(poses.size(), i + 1 + kMostSwapped);
      while (back < last && leaps(kept.back(), poses[back])) ++back;
      if (back < last) i = back;
    }
    kept.push_back(poses[i]);
  }
  return kept;
}

/// Fewer samples say nothing of a clock. Of a period: how far a sample may come from its instant, and the mean of a block, which wanders
/// where the clock is none.
constexpr std::size_t kLeastSamples = 200, kBlock = 100;
constexpr double kMostJitter = 0.6, kMostWander = 0.08;
constexpr int kRounds = 3;

void put_on_clock(Column& t_s) {
  const std::size_t n = t_s.size();
  if (n < kLeastSamples) return;
  Column intervals_s;
  for (std::size_t i = 1; i < n; ++i) intervals_s.push_back(t_s[i] - t_s[i - 1]);
  double period_s = io::upper_median(intervals_s), first_s = t_s[0];
  if (!(period_s > 0)) return;
  std::vector<double> count(n, 0);
  for (std::size_t i = 1; i < n; ++i)
    count[i] = count[i - 1] + std::max(1.0, std::round((t_s[i] - t_s[i - 1]) / period_s));
  for (int round = 0; round < kRounds; ++round) {
    double mean_count = 0, mean_s = 0, product = 0, square = 0;
    for (std::size_t i = 0; i < n; ++i)
      mean_count += count[i] / static_cast<double>(n), mean_s += t_s[i] / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      product += (count[i] - mean_count) * (t_s[i] - mean_s);
      square += (count[i] - mean_count) * (count[i] - mean_count);
    }
    period_s = product / square;
    first_s = mean_s - period_s * mean_count;
    if (round + 1 < kRounds)
      for (std::size_t i = 0; i < n; ++i) count[i] = std::round((t_s[i] - first_s) / period_s);
  }
  double block = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double late = (t_s[i] - first_s) / period_s - count[i];
    if (std::abs(late) > kMostJitter || (i > 0 && count[i] <= count[i - 1])) return;
    block += late / kBlock;
    if (i % kBlock != kBlock - 1) continue;
    if (std::abs(block) > kMostWander) return;
    block = 0;
  }
  for (std::size_t i = 0; i < n; ++i) t_s[i] = first_s + count[i] * period_s;
}

}  // namespace

FlightLog on_its_clocks(FlightLog log) {
  put_on_clock(log.mocap.t_s);
  put_on_clock(log.imu.t_s);
  if (log.power) put_on_clock(log.power->t_s);
  return log;
}

std::vector<PoseReading> pose_readings(const FlightLog& log) {
  const MocapStream& m = log.mocap;
  std::vector<PoseReading> poses;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const PoseReading pose{
        m.t_s[i] - log.header.mocap.latency_s, {m.x_m[i], m.y_m[i], m.z_m[i]}, {m.qw[i], m.qx[i], m.qy[i], m.qz[i]}};
    const bool lost = log.header.mocap.position_noise_m > 0 && !poses.empty() &&
                      pose.position_m == poses.back().position_m && pose.quaternion == poses.back().quaternion;
    if (!lost) poses.push_back(pose);
  }
  return without_swaps(poses);
}

std::size_t last_not_after(const std::vector<double>& times, double t_s) {
  const auto after = std::ranges::upper_bound(times, t_s);
  return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

}  // namespace flappy::flightlog
