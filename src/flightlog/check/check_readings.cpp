// Checks of single columns for what sensors do at their limits: an IMU clipped at its range, a rotor's counter that
// misses pulses, a battery's voltage that freezes.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Fewest equal samples at an end of a column that count as clipped, and how many times as many as at each of so many
/// values next to it. The readings of a sensor thin out towards their largest, and noise makes few of them equal.
constexpr std::size_t kFewestClipped = 5, kNextValues = 10;
constexpr double kTimesAsMany = 3;
/// More clipped samples of an axis forbid a diagnosis.
constexpr double kMaxClippedShare = 0.01;

/// Number of samples clipped at the end where sorted values begin.
template <class Iterator>
std::size_t clipped(Iterator from, Iterator to) {
  const auto count_of_next = [&] {
    const Iterator same = std::find_if(from, to, [value = *from](double v) { return v != value; });
    return static_cast<std::size_t>(std::distance(std::exchange(from, same), same));
  };
  const std::size_t at_end = from == to ? 0 : count_of_next();
  if (at_end < kFewestClipped) return 0;
  std::size_t next = 0, most = 0;
  for (; from != to && next < kNextValues; ++next) most = std::max(most, count_of_next());
  const bool many = static_cast<double>(at_end) > kTimesAsMany * static_cast<double>(most);
  return next == kNextValues && many ? at_end : 0;
}

/// Samples on both sides of one that give its usual value, and the share of that value to which the counter drops.
constexpr std::size_t kEachSide = 5;
constexpr double kDropped = 0.05, kHalved = 0.5, kUsual = 0.8;
/// Fewer dropped samples may be commands; more than this share of them forbid a diagnosis.
constexpr std::size_t kFewestDropped = 3;
constexpr double kMaxDroppedShare = 0.02;

/// A voltage is frozen that stays for so long, and so many times as long as it usually does. Digits make a voltage stay
/// for a while.
constexpr double kFrozen_s = 3, kTimesAsLong = 20;
/// Fewest changes that say how long it usually stays.
constexpr std::size_t kFewestChanges = 5;

}  // namespace

void check_range(const FlightLog& log, Findings& findings) {
  const ImuStream& s = log.imu;
  const std::tuple<const char*, const Column*, const char*> axes[] = {
      {"gyro_x_rad_s", &s.gyro_x_rad_s, "rad/s"}, {"gyro_y_rad_s", &s.gyro_y_rad_s, "rad/s"},
      {"gyro_z_rad_s", &s.gyro_z_rad_s, "rad/s"}, {"accel_x_m_s2", &s.accel_x_m_s2, "m/s^2"},
      {"accel_y_m_s2", &s.accel_y_m_s2, "m/s^2"}, {"accel_z_m_s2", &s.accel_z_m_s2, "m/s^2"}};
  bool any = false;
  for (const auto& [name, column, unit] : axes) {
    Column sorted = *column;
    std::ranges::sort(sorted);
    const std::size_t low = clipped(sorted.begin(), sorted.end()), high = clipped(sorted.rbegin(), sorted.rend());
    if (low + high == 0) continue;
    any = true;
    const double end = high >= low ? sorted.back() : sorted.front();
    const auto at = static_cast<std::size_t>(std::ranges::find(*column, end) - column->begin());
    const double share = static_cast<double>(low + high) / static_cast<double>(column->size());
    findings.push_back({"imu range",
                        Verdict::warning,
                        format("%zu of %zu samples of %s (%.2g %%) stand at %.4g %s, more than three times as many as "
                               "at any value next to it: clipped at the sensor's range",
                               low + high, column->size(), name, 100 * share, end, unit),
                        {{"share", share}},
                        share > kMaxClippedShare ? LogPlace{kImu, at + 2} : LogPlace{}});
  }
  if (!any && !s.t_s.empty()) findings.push_back({"imu range", Verdict::ok, "no axis is clipped", {}});
}

std::optional<Finding> dropped_readings(const std::string& check, const Column& values) {
  std::size_t zeros = 0, halves = 0, first = 0;
  for (std::size_t i = kEachSide; i + kEachSide < values.size(); ++i) {
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(i - kEachSide);
    const double usual = io::median(Column(from, from + 2 * kEachSide + 1));
    if (usual == 0 || values[i - 1] / usual < kUsual || values[i + 1] / usual < kUsual) continue;
    const double share = values[i] / usual;
    const bool zero = std::abs(share) < kDropped, half = std::abs(share - kHalved) < kDropped;
    if ((zero || half) && zeros + halves == 0) first = i;
    zeros += zero, halves += half;
  }
  if (zeros + halves < kFewestDropped) return std::nullopt;
  const double share = static_cast<double>(zeros + halves) / static_cast<double>(values.size());
  return Finding{
      check,
      Verdict::warning,
      format("drops for one sample to 0 (%zu times) or half (%zu times): a counter that misses pulses?", zeros, halves),
      {{"share", share}},
      share > kMaxDroppedShare ? LogPlace{kCommand, first + 2} : LogPlace{}};
}

std::optional<Finding> frozen_battery(const PowerStream& power) {
  const Column &t_s = power.t_s, &volts = power.battery_V;
  std::vector<double> stays;
  double longest = 0;
  std::size_t since = 0, frozen = 0;
  for (std::size_t i = 1; i <= volts.size(); ++i) {
    if (i < volts.size() && volts[i] == volts[since]) continue;
    const double stay = (i < volts.size() ? t_s[i] : t_s.back()) - t_s[since];
    if (stay > longest) longest = stay, frozen = since;
    stays.push_back(stay);
    since = i;
  }
  if (longest <= kFrozen_s) return std::nullopt;
  const double usual = io::upper_median(stays);
  const bool constant = stays.size() == 1;
  if (!constant && (stays.size() <= kFewestChanges || longest <= kTimesAsLong * usual)) return std::nullopt;
  return Finding{"battery",
                 Verdict::warning,
                 constant ? format("is %.4g V all the time: not measured", volts.front())
                          : format("stays at %.4g V for %.3g s from %.6g s on, though it usually changes after %.2g s: "
                                   "frozen",
                                   volts[frozen], longest, t_s[frozen], usual),
                 {{"longest_s", longest}},
                 {}};
}

}  // namespace flappy::flightlog
