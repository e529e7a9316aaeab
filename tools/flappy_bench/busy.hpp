// Cost of other processes: work per second of processor time with a busy loop on each processor, and without.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "speed.hpp"

namespace flappy::bench {

struct BusyRow {
  std::string part, unit;
  int threads;                     ///< 0: automatic
  Figure quiet_per_s, busy_per_s;  ///< work per second of processor time, summed over threads
  Figure processor_ratio,
      wall_ratio;  ///< busy over quiet, pair by pair, for work per second of processor time and of wall time
};

/// `progress(done, total)` is called between measurements.
std::vector<BusyRow> measure_busy(const model::Vehicle& vehicle, const std::string& configs,
                                  const SpeedOptions& options, const std::function<void(int, int)>& progress);

}  // namespace flappy::bench
