// How regularly the samples of a stream come.
#pragma once

#include <optional>
#include <string>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

struct StreamStatistics {
  std::string name;
  std::size_t samples = 0, missing = 0;  ///< missing only where a rate is declared
  double duration_s = 0, rate_hz = 0, longest_gap_s = 0;
  double jitter_s = 0;  ///< standard deviation of the intervals that miss no sample
  std::optional<double> declared_hz;
};

/// Of at least two times, which increase. A gap lacks samples by the median of the intervals, two and two together: bunches of samples lack none.
StreamStatistics stream_statistics(const std::string& name, const Column& t_s, std::optional<double> declared_hz);

}  // namespace flappy::flightlog
