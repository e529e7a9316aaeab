// What the times of a stream say of it: its rate, its gaps, its jitter.
//
// The period T is the most frequent interval. Each interval beyond 1.5 T counts as the samples that are missing in it;
// a sample that is only late makes a short interval besides, which is taken off.
//
// Rows that come in bunches of n, as two at a time and then a pause, are told by their sequence: n intervals in a row
// add up to n T, and exactly one of them is long. A stream of which each third sample is missing has the sequence of
// pairs, and is taken for pairs. Of bunches of three and more the short interval is below half of the mean: where
// every fourth sample is missing it is not.
#pragma once

#include <optional>
#include <string>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

struct StreamStatistics {
  std::string name;
  std::size_t samples = 0, missing = 0;  ///< missing is counted only where a rate is declared
  double duration_s = 0, rate_hz = 0, longest_gap_s = 0;
  double jitter_s = 0;  ///< standard deviation of the intervals in which no sample is missing
  std::optional<double> declared_hz;
};

/// `t_s`: at least two increasing times.
StreamStatistics stream_statistics(const std::string& name, const Column& t_s, std::optional<double> declared_hz);

}  // namespace flappy::flightlog
