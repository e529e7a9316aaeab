// How far the clock of stamps is off that of the receiver, from when stamped messages were received.
//
// A message is received after its stamp by the offset of the clocks and its delay. Delays vary but are never below a least one, so
// the points (stamp, received - stamp) lie above a line, which is the offset with the least delay in it: the edge of their lower
// convex hull below the middle of the stamps, of all lines below the points the one that is nearest to them (Moon, Skelly,
// Towsley, INFOCOM 1999). Its slope is the drift. What the least delay itself is, no such pair of times can say.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace flappy::flightlog {

/// When a message was stamped, and when it was received.
using StampedReceipt = std::pair<std::int64_t, std::int64_t>;

/// A line from stamps to the receiver's clock.
class ClockLine {
 public:
  /// The same clock, but for this.
  explicit ClockLine(std::int64_t offset_ns = 0) : base_ns_(offset_ns) {}
  /// Below pairs of stamp and time of receipt, at least one. Over less than kLeastSpan_s, or where the line would be steeper than
  /// kMostDrift, there is no drift.
  static ClockLine below(std::vector<StampedReceipt> pairs);

  static constexpr double kLeastSpan_s = 20, kMostDrift = 1e-3;

  /// kNoTime where 64 bits do not hold it.
  std::int64_t received_ns(std::int64_t stamp_ns) const;
  /// At the first stamp.
  double offset_s() const;
  double drift() const { return slope_; }

 private:
  std::int64_t base_ns_, origin_ns_ = 0;
  double slope_ = 0, above_ns_ = 0;  ///< the line above the base, at the origin
};

struct TimeRange {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min(), to_ns = std::numeric_limits<std::int64_t>::max();
  bool contains(std::int64_t t_ns) const { return t_ns >= from_ns && t_ns <= to_ns; }
};

/// Where most of the times lie: of their parts, which lie more than kLongestGap_s apart, the one that has most of them; everything, of none. What lies
/// elsewhere was stamped before its clock was set, or rolled over.
TimeRange main_range(std::vector<std::int64_t> times_ns);

/// The pairs whose difference is in the main_range() of all differences: one time of a wrong clock would bend the line.
std::vector<StampedReceipt> without_outliers(std::vector<StampedReceipt> pairs);

}  // namespace flappy::flightlog
