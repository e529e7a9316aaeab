// When sensors sample, when samples arrive, and what the estimator does with them. This is the same for every flapper
// of a batch, so it is computed once for each control period. Sensor rates need not divide each other or the control
// rate: a sample is taken at the first physics step at or after its time.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "flight/setup.hpp"

namespace flappy::flight {

/// Physics steps up to a sample, or to the end of the period.
struct Slice {
  int steps = 0;
  bool imu = false, mocap = false;  // a sample is taken at its end
  std::uint32_t imu_index = 0, mocap_index = 0;
  double imu_interval_s = 0;
  int mocap_slot = 0;  // in the queue of poses in transit
};

/// Moves a pose by a share of the IMU increment in `slot` of the ring; the whole increment takes duration_s.
struct Advance {
  int slot = 0;
  double share = 0, duration_s = 0;
};

/// Moves the horizon to the mocap pose in `slot`, by `count` of Period::advance from `first` on, then corrects.
struct Correction {
  int slot = 0, first = 0, count = 0;
  std::uint32_t index = 0;       // number of the mocap sample
  double time_s = 0, age_s = 0;  // time at which the pose was sampled; time from then to the end of the period
};

struct Period {
  std::int64_t first_step = 0;
  std::vector<Slice> slices;
  int push_slot = -1;  // slot of the ring that receives the IMU increment of this period; -1: no IMU sample
  std::vector<Correction> corrections;
  std::vector<Advance> advance;  // moves the horizon
  std::vector<Advance> replay;   // moves the present: from the horizon after a correction, else from the last present
  Advance newest{-1, 1, 0};      // newest IMU increment that has arrived; slot -1: none yet
  double ahead_s = 0;            // from the present to the end of the period
};

class Schedule {
 public:
  /// Throws std::invalid_argument if a sensor samples more than once in a physics step.
  Schedule(const Sensors& sensors, double step_s, int period_steps);

  const Period& next();

  int ring_slots() const { return ring_slots_; }
  int queue_slots() const { return queue_slots_; }
  double imu_lag_s() const { return lag_s_; }
  /// Longest time from the sample of a pose to the end of the control period that fuses it.
  double longest_wait_s() const { return wait_s_; }

  /// IMU increments in the ring, which end after the horizon. A new flight has to fill their slots.
  std::vector<Advance> pending() const;
  /// The newest IMU increment that has arrived; the horizon may have passed it already. Slot -1: none yet.
  const Advance& newest() const { return period_.newest; }
  /// Time from the horizon to the end of the last control period.
  double horizon_age_s() const { return now_s() - horizon_s_; }
  /// Time from the end of the last replayed increment to the end of the last control period.
  double present_age_s() const { return now_s() - present_s_; }

 private:
  struct Entry {
    int slot;
    double from_s, to_s, arrival_s;  // interval of the motion (sample times less the low-pass lag), and time of arrival
    bool replayed = false;
  };
  struct Pose {
    int slot;
    std::uint32_t index;
    double time_s, arrival_s;
  };
  double now_s() const { return static_cast<double>(step_) * step_s_; }
  std::int64_t sample_step(double rate_hz, std::int64_t index) const;
  void sample(std::int64_t end);
  void correct_arrived();
  void replay();

  Sensors sensors_;
  double step_s_, lag_s_, wait_s_;
  int period_steps_, ring_slots_, queue_slots_;
  std::int64_t step_ = 0, imu_count_ = 0, mocap_count_ = 0, pushed_ = 0;
  double last_imu_s_ = 0, horizon_s_, present_s_;
  std::deque<Entry> ring_;  // IMU increments that end after the horizon, oldest first
  std::deque<Pose> queue_;  // poses not yet used for a correction, oldest first
  Period period_;
};

}  // namespace flappy::flight
