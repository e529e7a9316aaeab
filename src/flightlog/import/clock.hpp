// Offset and drift between the clock of stamps and that of the receiver, from times of stamped messages.
//
// received - stamp = offset of the clocks + delay. Delays have a minimum, so all points (stamp, received - stamp) lie
// above the line offset + least delay. The nearest line below them is the edge of their lower convex hull below the
// mean stamp (Moon, Skelly, Towsley, INFOCOM 1999). Its slope is the drift. The least delay is undeterminable and
// counts as offset.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace flappy::flightlog {

/// Stamp and time of receipt of a message, ns.
using StampedReceipt = std::pair<std::int64_t, std::int64_t>;

/// A linear map from stamps to the receiver's clock.
class ClockLine {
 public:
  explicit ClockLine(std::int64_t offset_ns = 0) : base_ns_(offset_ns) {}
  /// The line below all `pairs`, at least one; drift 0 for a span below kMinSpan_s or a slope beyond kMaxDrift.
  static ClockLine below(std::vector<StampedReceipt> pairs);

  static constexpr double kMinSpan_s = 20, kMaxDrift = 1e-3;

  /// A stamp on the receiver's clock; kNoTime where the result exceeds 64 bits.
  std::int64_t received_ns(std::int64_t stamp_ns) const;
  /// Receiver's time less stamp, at the first stamp.
  double offset_s() const;
  double drift() const { return slope_; }

 private:
  std::int64_t base_ns_, origin_ns_ = 0;
  double slope_ = 0, above_ns_ = 0;  ///< slope, and height of the line above base_ns_ at origin_ns_
};

struct TimeRange {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min(), to_ns = std::numeric_limits<std::int64_t>::max();
  bool contains(std::int64_t t_ns) const { return t_ns >= from_ns && t_ns <= to_ns; }
};

/// The range in which most of the times lie: they are cut where more than kLongestGap_s apart; the part with most times
/// wins; without times, everything. Times outside were stamped before the clock was set or after it rolled over.
TimeRange main_range(std::vector<std::int64_t> times_ns);

/// The pairs whose difference lies in the main_range() of all: one time of a wrong clock would tilt the line.
std::vector<StampedReceipt> without_outliers(std::vector<StampedReceipt> pairs);

}  // namespace flappy::flightlog
