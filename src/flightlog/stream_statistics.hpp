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

/// `t_s`: at least two increasing times. The usual interval is half the median span of two, so samples that arrive in
/// pairs are regular; missing samples are counted by it.
StreamStatistics stream_statistics(const std::string& name, const Column& t_s, std::optional<double> declared_hz);

}  // namespace flappy::flightlog
