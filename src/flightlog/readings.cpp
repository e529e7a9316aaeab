#include "flightlog/readings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// A pose that turns or moves by more than this leaps: its markers were swapped. Swaps last kMaxSwapped poses at most.
constexpr double kLeap_rad = 0.5, kLeap_rad_s = 40, kLeap_m = 0.05, kLeap_m_s = 10;
constexpr std::size_t kMaxSwapped = 10;
/// Also swapped: mocap and second estimator differ by over kTurned_rad and kTurnedUsual times the median.
constexpr double kTurned_rad = 0.35, kTurnedUsual = 6;
/// Yaw between the estimators is constant over kBlock_s, taken from about kTried poses; attitude.csv is interpolated
/// over gaps of up to kLongestBridged intervals.
constexpr double kBlock_s = 10, kLongestBridged = 3.5;
constexpr std::size_t kTried = 100;

bool leaps(const PoseReading& from, const PoseReading& to) {
  const double dt_s = std::abs(to.t_s - from.t_s);
  return from.attitude().angularDistance(to.attitude()) > kLeap_rad + kLeap_rad_s * dt_s ||
         (to.position_m - from.position_m).norm() > kLeap_m + kLeap_m_s * dt_s;
}

std::vector<PoseReading> fresh_poses(const FlightLog& log) {
  const MocapStream& m = log.mocap;
  std::vector<PoseReading> poses;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const PoseReading pose{
        m.t_s[i] - log.header.mocap.latency_s, {m.x_m[i], m.y_m[i], m.z_m[i]}, {m.qw[i], m.qx[i], m.qy[i], m.qz[i]}, i};
    const bool lost = log.header.mocap.position_noise_m > 0 && !poses.empty() &&
                      pose.position_m == poses.back().position_m && pose.quaternion == poses.back().quaternion;
    if (!lost) poses.push_back(pose);
  }
  return poses;
}

/// Removes poses that leap away from the pose before, if the poses leap back within kMaxSwapped.
std::vector<PoseReading> without_swaps(const std::vector<PoseReading>& poses) {
  std::vector<PoseReading> kept;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!kept.empty() && leaps(kept.back(), poses[i])) {
      std::size_t back = i + 1;
      const std::size_t last = std::min(poses.size(), i + 1 + kMaxSwapped);
      while (back < last && leaps(kept.back(), poses[back])) ++back;
      if (back < last) i = back;
    }
    kept.push_back(poses[i]);
  }
  return kept;
}

/// Least number of samples for a clock, and of a block. Limits, as shares of the period: kMaxJitter for one sample's
/// deviation, kMaxWander for a block's mean deviation, which is large where the clock is irregular.
constexpr std::size_t kMinSamples = 200, kBlock = 100;
constexpr double kMaxJitter = 0.6, kMaxWander = 0.08;
constexpr int kRounds = 3;

void put_on_clock(Column& t_s) {
  const std::size_t n = t_s.size();
  if (n < kMinSamples) return;
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
    if (std::abs(late) > kMaxJitter || (i > 0 && count[i] <= count[i - 1])) return;
    block += late / kBlock;
    if (i % kBlock != kBlock - 1) continue;
    if (std::abs(block) > kMaxWander) return;
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

std::vector<PoseReading> pose_readings(const FlightLog& log) { return without_swaps(fresh_poses(log)); }

std::vector<std::optional<Eigen::Quaterniond>> second_attitudes(const FlightLog& log) {
  std::vector<std::optional<Eigen::Quaterniond>> all(log.mocap.t_s.size());
  if (!log.attitude) return all;
  const AttitudeStream& a = *log.attitude;
  const double longest_s = kLongestBridged / log.header.attitude->rate_hz;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double t_s = log.mocap.t_s[i] - log.header.mocap.latency_s + log.header.attitude->latency_s;
    if (t_s < a.t_s.front() || t_s > a.t_s.back()) continue;
    const std::size_t k = std::min(last_not_after(a.t_s, t_s), a.t_s.size() - 2);
    const double step_s = a.t_s[k + 1] - a.t_s[k];
    const auto at = [&](std::size_t j) { return Eigen::Quaterniond(a.qw[j], a.qx[j], a.qy[j], a.qz[j]); };
    if (step_s <= longest_s) all[i] = at(k).slerp((t_s - a.t_s[k]) / step_s, at(k + 1));
  }
  return all;
}

std::vector<char> swapped_poses(const FlightLog& log) {
  const MocapStream& m = log.mocap;
  const std::size_t n = m.t_s.size();
  std::vector<char> swapped(n, 0);
  const std::vector<std::optional<Eigen::Quaterniond>> others = second_attitudes(log);
  // The rotation between the world frames of both estimators drifts slowly, with the yaw of the second one.
  std::vector<double> angles(n, 0), known;
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    while (end < n && m.t_s[end] <= m.t_s[begin] + kBlock_s) ++end;
    std::vector<std::pair<std::size_t, Eigen::Quaterniond>> turns;
    for (std::size_t i = begin; i < end; ++i)
      if (others[i])
        turns.emplace_back(i, Eigen::Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i]) * others[i]->conjugate());
    if (turns.empty()) continue;
    // Median rotation: the one with the least sum of angles to the others, from a subset.
    const std::size_t stride = turns.size() / kTried + 1;
    double least = std::numeric_limits<double>::infinity();
    const Eigen::Quaterniond* middle = &turns.front().second;
    for (std::size_t i = 0; i < turns.size(); i += stride) {
      double sum = 0;
      for (std::size_t k = 0; k < turns.size(); k += stride) sum += turns[i].second.angularDistance(turns[k].second);
      if (sum < least) least = sum, middle = &turns[i].second;
    }
    for (const auto& [i, turn] : turns) known.push_back(angles[i] = middle->angularDistance(turn));
  }
  const double most = known.empty() ? 0 : std::max(kTurned_rad, kTurnedUsual * io::median(known));
  for (std::size_t i = 0; i < n && !known.empty(); ++i) swapped[i] = angles[i] > most ? 1 : 0;
  std::vector<PoseReading> rest;
  for (const PoseReading& pose : fresh_poses(log))
    if (!swapped[pose.row]) rest.push_back(pose);
  std::vector<char> leaping(n, 0);
  for (const PoseReading& pose : rest) leaping[pose.row] = 1;
  for (const PoseReading& pose : without_swaps(rest)) leaping[pose.row] = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (leaping[i]) swapped[i] = 1;
  return swapped;
}

std::size_t last_not_after(const std::vector<double>& times, double t_s) {
  const auto after = std::ranges::upper_bound(times, t_s);
  return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

}  // namespace flappy::flightlog
