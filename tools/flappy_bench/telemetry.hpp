// What it costs to show flappers over DDS in real time.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace flappy::bench {

struct TelemetryCost {
  std::size_t flappers = 0, shown = 0, dropped = 0,
              heard = 0;  ///< samples of flappers; poses that another process heard
  double latency_median_s = 0, latency_p99_s = 0, latency_most_s = 0;  ///< from the flight thread to the other process
  double cpu_share = 0;                                                ///< of one processor, for each flapper
};

/// Shows so many flappers at 500 Hz for so long, to a process that reads all their topics. To be called before this process has
/// any thread.
TelemetryCost measure_telemetry(std::size_t flappers, double duration_s);

}  // namespace flappy::bench
