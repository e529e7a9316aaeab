// When sensors sample, when their samples arrive, and what estimator then does: the same for every flapper of a batch, so it
// is worked out once for each control period. Rates need divide neither each other nor the control rate; a sample is
// taken at the first physics step that has reached its time.
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
  int mocap_slot = 0;  // in the queue of poses on their way
};

/// A share of the increment in a slot of the ring.
struct Advance {
  int slot = 0;
  double share = 0, duration_s = 0;
};

/// Moves the horizon to the time of the pose in `slot`, by `count` advances from `first` on, and corrects.
struct Correction {
  int slot = 0, first = 0, count = 0;
  std::uint32_t index = 0;       // of the sample
  double time_s = 0, age_s = 0;  // when it was taken; from then to the end of the period
};

/// What one control period does.
struct Period {
  std::int64_t first_step = 0;
  std::vector<Slice> slices;
  int push_slot = -1;  // of the ring, for what the IMU gathered; -1: it gathered nothing
  std::vector<Correction> corrections;
  std::vector<Advance> advance;  // of the horizon
  std::vector<Advance> replay;   // of the present: from the new horizon if there is one, else from where it was
  Advance newest{-1, 1, 0};      // of what has arrived from the IMU; slot -1: nothing yet
  double ahead_s = 0;            // from the present to the end of the period
};

class Schedule {
 public:
  /// `period_steps` physics steps of `step_s` in a control period. std::invalid_argument where a sensor would sample more
  /// than once in a step.
  Schedule(const Sensors& sensors, double step_s, int period_steps);

  const Period& next();

  int ring_slots() const { return ring_slots_; }
  int queue_slots() const { return queue_slots_; }
  double imu_lag_s() const { return lag_s_; }
  double longest_wait_s() const {
    return wait_s_;
  }  // of a pose, from its sample to the end of the period that fuses it

  /// Increments that lie between the horizon and the end of the last period; what a new flight starts from.
  std::vector<Advance> pending() const;
  /// The newest increment that has arrived, which the horizon may already have passed; slot -1: none yet.
  const Advance& newest() const { return period_.newest; }
  /// From the horizon, and from the last replayed increment, to the end of the last period.
  double horizon_age_s() const { return now_s() - horizon_s_; }
  double present_age_s() const { return now_s() - present_s_; }

 private:
  struct Entry {
    int slot;
    double from_s, to_s, arrival_s;  // times of what was measured: the sample's, less its lag
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
  std::deque<Entry> ring_;  // beyond the horizon, oldest first
  std::deque<Pose> queue_;  // not yet corrected by
  Period period_;
};

}  // namespace flappy::flight
