#include "flight/schedule.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flappy::flight {
namespace {

constexpr double kSame_s = 1e-9;  // times closer than this count as equal

/// Rounds to whole microseconds, the resolution of the clocks on board.
double whole_us(double s) { return std::round(s * 1e6) / 1e6; }

}  // namespace

Schedule::Schedule(const Sensors& sensors, double step_s, int period_steps)
    : sensors_(sensors), step_s_(step_s), lag_s_(whole_us(low_pass_lag_s(sensors.imu))), period_steps_(period_steps) {
  if (sensors.imu.rate_hz * step_s > 1 + 1e-9 || sensors.mocap.rate_hz * step_s > 1 + 1e-9)
    throw std::invalid_argument("a sensor's rate is above that of the physics steps");
  const double period_s = step_s * period_steps;
  // a pose is fused at the end of the first control period in which it and the IMU samples up to its time have arrived
  wait_s_ =
      period_s + std::max(sensors.mocap.latency_s, sensors.imu.latency_s + lag_s_ + 1 / sensors.imu.rate_hz + period_s);
  ring_slots_ = static_cast<int>(std::ceil((wait_s_ + 1 / sensors.mocap.rate_hz) / period_s)) + 2;
  queue_slots_ = static_cast<int>(std::ceil(wait_s_ * sensors.mocap.rate_hz)) + 1;
  horizon_s_ = present_s_ = -lag_s_;
}

/// Number of physics steps after which sample `index` is taken; samples are counted from 1.
std::int64_t Schedule::sample_step(double rate_hz, std::int64_t index) const {
  return static_cast<std::int64_t>(std::ceil(static_cast<double>(index) / (rate_hz * step_s_) - 1e-6));
}

const Period& Schedule::next() {
  const Advance newest = period_.newest;
  period_ = {};
  period_.newest = newest;
  period_.first_step = step_;
  sample(step_ + period_steps_);
  correct_arrived();
  replay();
  return period_;
}

/// Cuts the control period, up to physics step `end`, into slices that end at samples.
void Schedule::sample(std::int64_t end) {
  const double gathered_from_s = last_imu_s_;
  while (step_ < end) {
    const std::int64_t imu = sample_step(sensors_.imu.rate_hz, imu_count_ + 1);
    const std::int64_t mocap = sample_step(sensors_.mocap.rate_hz, mocap_count_ + 1);
    const std::int64_t until = std::min({imu, mocap, end});
    Slice slice;
    slice.steps = static_cast<int>(until - step_);
    step_ = until;
    if (imu == until) {
      slice.imu = true;
      slice.imu_index = static_cast<std::uint32_t>(imu_count_++);
      slice.imu_interval_s = now_s() - last_imu_s_;
      last_imu_s_ = now_s();
    }
    if (mocap == until) {
      slice.mocap = true;
      slice.mocap_index = static_cast<std::uint32_t>(mocap_count_);
      slice.mocap_slot = static_cast<int>(mocap_count_++ % queue_slots_);
      queue_.push_back({slice.mocap_slot, slice.mocap_index, now_s(), now_s() + sensors_.mocap.latency_s});
    }
    period_.slices.push_back(slice);
  }
  if (last_imu_s_ > gathered_from_s) {
    period_.push_slot = static_cast<int>(pushed_++ % ring_slots_);
    ring_.push_back(
        {period_.push_slot, gathered_from_s - lag_s_, last_imu_s_ - lag_s_, last_imu_s_ + sensors_.imu.latency_s});
  }
}

/// Plans a correction for each pose that has arrived and whose time the arrived IMU increments cover.
void Schedule::correct_arrived() {
  const auto covered_s = [&] {
    double until = horizon_s_;
    for (const Entry& e : ring_)
      if (e.arrival_s <= now_s() + kSame_s) until = e.to_s;
    return until;
  }();
  while (!queue_.empty() && queue_.front().arrival_s <= now_s() + kSame_s &&
         queue_.front().time_s <= covered_s + kSame_s) {
    const double target = queue_.front().time_s;
    Correction correction{
        queue_.front().slot, static_cast<int>(period_.advance.size()), 0, queue_.front().index, target,
        now_s() - target};
    queue_.pop_front();
    while (!ring_.empty() && ring_.front().from_s < target - kSame_s) {
      const Entry& e = ring_.front();
      const double duration = e.to_s - e.from_s, until = std::min(e.to_s, target);
      if (until > horizon_s_ + kSame_s) period_.advance.push_back({e.slot, (until - horizon_s_) / duration, duration});
      horizon_s_ = std::max(horizon_s_, until);
      period_.newest = {e.slot, 1, duration};  // replay() replaces it if there is a newer one
      if (e.to_s > target + kSame_s) break;
      ring_.pop_front();
    }
    correction.count = static_cast<int>(period_.advance.size()) - correction.first;
    period_.corrections.push_back(correction);
  }
}

void Schedule::replay() {
  const bool anew = !period_.corrections.empty();
  if (anew) present_s_ = horizon_s_;
  for (Entry& e : ring_) {
    if (e.arrival_s > now_s() + kSame_s) break;
    const double from = std::max(e.from_s, horizon_s_), duration = e.to_s - e.from_s;
    if (!anew && e.replayed) continue;
    period_.replay.push_back({e.slot, (e.to_s - from) / duration, duration});
    e.replayed = true;
    present_s_ = e.to_s;
    period_.newest = {e.slot, 1, duration};
  }
  period_.ahead_s = now_s() - present_s_;
}

std::vector<Advance> Schedule::pending() const {
  std::vector<Advance> list;
  for (const Entry& e : ring_) list.push_back({e.slot, 1, e.to_s - e.from_s});
  return list;
}

}  // namespace flappy::flight
