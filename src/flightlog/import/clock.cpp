#include "flightlog/import/clock.hpp"

#include <algorithm>
#include <cmath>

#include "flightlog/flight_log.hpp"
#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {
namespace {

struct Point {
  double x_s, y_ns;
};

/// The lower convex hull of points that are sorted by x.
std::vector<Point> lower_hull(const std::vector<Point>& points) {
  std::vector<Point> hull;
  for (const Point& p : points) {
    while (hull.size() >= 2) {
      const Point &a = hull[hull.size() - 2], &b = hull.back();
      if ((b.x_s - a.x_s) * (p.y_ns - a.y_ns) > (b.y_ns - a.y_ns) * (p.x_s - a.x_s)) break;
      hull.pop_back();
    }
    hull.push_back(p);
  }
  return hull;
}

}  // namespace

TimeRange main_range(std::vector<std::int64_t> times_ns) {
  constexpr auto kApart_ns = static_cast<std::uint64_t>(1e9 * kLongestGap_s);
  // unsigned, because the difference of two times may exceed 63 bits
  const auto apart = [](std::int64_t a, std::int64_t b) {
    return static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
  };
  if (times_ns.empty()) return {};
  std::ranges::sort(times_ns);
  TimeRange most;
  std::size_t count = 0;
  for (std::size_t begin = 0, end = 1; begin < times_ns.size(); begin = end++) {
    while (end < times_ns.size() && apart(times_ns[end - 1], times_ns[end]) <= kApart_ns) ++end;
    if (end - begin <= count) continue;
    count = end - begin;
    most = {times_ns[begin], times_ns[end - 1]};
  }
  return most;
}

std::vector<StampedReceipt> without_outliers(std::vector<StampedReceipt> pairs) {
  std::vector<std::int64_t> differences;
  for (const auto& [stamp, received] : pairs) differences.push_back(received - stamp);
  const TimeRange usual = main_range(std::move(differences));
  std::erase_if(pairs, [&](const StampedReceipt& pair) { return !usual.contains(pair.second - pair.first); });
  return pairs;
}

ClockLine ClockLine::below(std::vector<StampedReceipt> pairs) {
  std::ranges::sort(pairs);
  ClockLine line;
  line.origin_ns_ = pairs.front().first;
  line.base_ns_ = pairs.front().second - pairs.front().first;
  std::vector<Point> points;
  double least_ns = 0, middle_s = 0;
  for (const auto& [stamp, received] : pairs) {
    // relative to the first pair, so that a double resolves nanoseconds
    const Point p{1e-9 * static_cast<double>(stamp - line.origin_ns_),
                  static_cast<double>(received - stamp - line.base_ns_)};
    if (points.empty() || p.x_s > points.back().x_s) points.push_back(p);  // sorted: least delay first
    least_ns = std::min(least_ns, p.y_ns);
    middle_s += p.x_s / static_cast<double>(pairs.size());
  }
  line.above_ns_ = least_ns;
  if (points.back().x_s < kMinSpan_s) return line;
  const std::vector<Point> hull = lower_hull(points);
  std::size_t i = 0;
  while (i + 2 < hull.size() && hull[i + 1].x_s < middle_s) ++i;
  const double slope_ns_s = (hull[i + 1].y_ns - hull[i].y_ns) / (hull[i + 1].x_s - hull[i].x_s);
  if (std::abs(slope_ns_s) > 1e9 * kMaxDrift) return line;
  line.slope_ = 1e-9 * slope_ns_s;
  line.above_ns_ = hull[i].y_ns - slope_ns_s * hull[i].x_s;
  return line;
}

std::int64_t ClockLine::received_ns(std::int64_t stamp_ns) const {
  const double above_ns = above_ns_ + slope_ * static_cast<double>(stamp_ns - origin_ns_);
  std::int64_t sum = 0;
  const bool too_far =
      __builtin_add_overflow(stamp_ns, base_ns_, &sum) || __builtin_add_overflow(sum, std::llround(above_ns), &sum);
  return too_far ? kNoTime : sum;
}

double ClockLine::offset_s() const { return 1e-9 * (static_cast<double>(base_ns_) + above_ns_); }

}  // namespace flappy::flightlog
