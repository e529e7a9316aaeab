// Cost of publishing flappers over DDS in real time.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace flappy::bench {

struct TelemetryCost {
  std::size_t flappers = 0, shown = 0, dropped = 0,
              heard = 0;  ///< shown, dropped: samples of flappers; heard: poses that another process received
  double latency_median_s = 0, latency_p99_s = 0, latency_most_s = 0;  ///< from the flight thread to the other process
  double cpu_share = 0;                                                ///< share of one processor for each flapper
};

/// Publishes `flappers` flappers at 500 Hz for `duration_s` to a process that reads all their topics. It forks, so it must be called
/// before this process has any thread.
TelemetryCost measure_telemetry(std::size_t flappers, double duration_s);

}  // namespace flappy::bench
