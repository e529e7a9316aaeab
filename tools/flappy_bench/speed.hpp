// Steps per second of our simulator and of its peers, measured alternately within one run.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::bench {

struct Figure {
  double median = 0, low = 0, high = 0;
};

/// Processor time of this thread, s.
double processor_seconds();

/// Median and range of a quantity over rounds.
Figure summary(std::vector<double> values);

struct SpeedReport {
  struct Row {
    std::string name;
    Figure steps_per_s;
  };
  std::vector<Row> rows;      // one core
  Figure two_thread_scaling;  // speed-up of wall time, pair by pair
  struct Size {
    std::size_t flappers;
    Figure ns_per_step;  // per flapper and step, one core
  };
  std::vector<Size> sizes;
  std::size_t frozen = 0;  // must stay 0: steps of a frozen flapper would be counted as work

  std::optional<double> median(const std::string& name) const;
};

struct SpeedOptions {
  int rounds = 5;
  double seconds = 0.3;  ///< of each measurement
  bool peers = true;
};

/// `progress(done, total)` is called between measurements.
SpeedReport measure_speed(const model::Vehicle& vehicle, const SpeedOptions& options,
                          const std::function<void(int, int)>& progress);

}  // namespace flappy::bench
