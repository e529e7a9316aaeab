// The schedule against a model of its own: samples are counted in integers, slots hold what was written into them last,
// and whoever reads a slot must find there what he came for.
#include "flight/schedule.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "full.hpp"

namespace flappy::flight::schedule_test {
namespace {

constexpr double kStep_s = 1e-4;
constexpr int kPeriodSteps = 20, kPeriods = 2500;
constexpr double kSame_s = 1e-8;  // of 5 s in double; a step is 1e-4

struct Case {
  int imu_hz, mocap_hz;
  double mocap_latency_s, imu_latency_s, low_pass_hz;
};

Sensors sensors_of(const Case& c) {
  Sensors s;
  s.imu.rate_hz = c.imu_hz;
  s.imu.latency_s = c.imu_latency_s;
  s.imu.low_pass_hz = c.low_pass_hz;
  s.mocap.rate_hz = c.mocap_hz;
  s.mocap.latency_s = c.mocap_latency_s;
  return s;
}

/// First step at or after k / rate, k from 1.
std::int64_t sample_step(int rate_hz, std::int64_t k) { return (k * 10000 + rate_hz - 1) / rate_hz; }

/// Follows a schedule period by period; `fault` is the first thing that was not as it must be.
class Follower {
 public:
  explicit Follower(const Case& c) : c_(c), schedule_(sensors_of(c), kStep_s, kPeriodSteps) {
    const double share = c.low_pass_hz > 0 ? 1 - std::exp(-2 * M_PI * c.low_pass_hz / c.imu_hz) : 1;
    lag_s_ = (1 - share) / share / c.imu_hz;  // sum of n (1 - share)^n share, in samples
    lag_s_ = std::round(lag_s_ * 1e6) / 1e6;  // clocks count microseconds
    horizon_s_ = present_s_ = covered_s_ = -lag_s_;
  }

  void step() {
    const Period& p = schedule_.next();
    slices(p);
    push(p);
    for (const Increment& i : in_order_)
      if (i.arrival_s <= now_s() + kSame_s) covered_s_ = i.to_s, newest_ = i;
    const double before = present_s_;
    for (const Correction& f : p.corrections) correct(p, f);
    if (!p.corrections.empty()) present_s_ = horizon_s_;
    for (const Advance& a : p.replay) present_s_ = walk(present_s_, a, "replay");
    expect(present_s_ >= before - kSame_s || !p.corrections.empty(), "the present goes back");
    expect(near(present_s_, std::max(covered_s_, horizon_s_)),
           "the present is not where the IMU's arrived samples end");
    expect(near(p.ahead_s, now_s() - present_s_), "ahead_s");
    const auto next = poses_.find(next_pose_);
    expect(next == poses_.end() || next->second.arrival_s > now_s() + kSame_s ||
               next->second.time_s > covered_s_ + kSame_s,
           "a pose could have corrected");
    if (newest_) {
      expect(p.newest.slot >= 0 && near(ring_[p.newest.slot].to_s, newest_->to_s) && p.newest.share == 1 &&
                 near(p.newest.duration_s, newest_->to_s - newest_->from_s),
             "newest is not the last increment that has arrived");
    } else expect(p.newest.slot == -1, "newest before there is any");
    pending();
  }

  std::string fault;
  int corrected() const { return next_pose_; }

 private:
  struct Increment {
    double from_s, to_s, arrival_s;
  };
  struct Pose {
    double time_s, arrival_s;
  };
  double now_s() const { return static_cast<double>(steps_) * kStep_s; }
  static bool near(double a, double b) { return std::abs(a - b) < kSame_s; }
  void expect(bool holds, const char* what) {
    if (holds || !fault.empty()) return;
    std::ostringstream text;
    text << what << " at " << now_s() << " s: IMU " << c_.imu_hz << " Hz + " << c_.imu_latency_s << " s, low-pass "
         << c_.low_pass_hz << " Hz, motion capture " << c_.mocap_hz << " Hz + " << c_.mocap_latency_s << " s";
    fault = text.str();
  }

  /// Slices sum to the period; each sample is taken at its step, once, in order, and nowhere else.
  void slices(const Period& p) {
    expect(p.first_step == steps_, "first_step");
    const std::int64_t end = steps_ + kPeriodSteps;
    for (const Slice& s : p.slices) {
      expect(s.steps > 0, "an empty slice");
      steps_ += s.steps;
      expect(s.imu == (steps_ == sample_step(c_.imu_hz, imu_ + 1)), "an IMU sample at the wrong step");
      expect(s.mocap == (steps_ == sample_step(c_.mocap_hz, mocap_ + 1)), "a pose at the wrong step");
      expect(
          steps_ < sample_step(c_.imu_hz, imu_ + 1) + s.imu && steps_ < sample_step(c_.mocap_hz, mocap_ + 1) + s.mocap,
          "a sample was left out");
      if (s.imu) {
        expect(s.imu_index == imu_, "imu_index");
        expect(near(s.imu_interval_s, now_s() - static_cast<double>(last_imu_) * kStep_s), "imu_interval_s");
        ++imu_, last_imu_ = steps_;
      }
      if (s.mocap) {
        expect(s.mocap_index == mocap_, "mocap_index");
        expect(s.mocap_slot >= 0 && s.mocap_slot < schedule_.queue_slots(), "mocap_slot");
        poses_[mocap_] = {now_s(), now_s() + c_.mocap_latency_s};
        queue_[s.mocap_slot] = mocap_++;
      }
    }
    expect(steps_ == end, "slices do not sum to the period");
  }

  void push(const Period& p) {
    expect((p.push_slot >= 0) == (last_imu_ > last_pushed_), "push_slot");
    if (p.push_slot < 0) return;
    expect(p.push_slot < schedule_.ring_slots(), "push_slot");
    const auto time = [&](std::int64_t step) { return static_cast<double>(step) * kStep_s - lag_s_; };
    ring_[p.push_slot] = {time(last_pushed_), time(last_imu_), time(last_imu_) + lag_s_ + c_.imu_latency_s};
    in_order_.push_back(ring_[p.push_slot]);
    if (in_order_.size() > 100) in_order_.erase(in_order_.begin());
    last_pushed_ = last_imu_;
  }

  /// From `at` on through a share of an increment: the slot must hold the increment that covers this time.
  double walk(double at, const Advance& a, const char* what) {
    const auto held = ring_.find(a.slot);
    if (held == ring_.end()) {
      expect(false, what);
      return at;
    }
    const Increment& i = held->second;
    const double to = at + a.share * a.duration_s;
    expect(near(a.duration_s, i.to_s - i.from_s), what);
    expect(a.share > 0 && a.share <= 1 + 1e-9 && at >= i.from_s - kSame_s && to <= i.to_s + kSame_s, what);
    expect(i.arrival_s <= now_s() + kSame_s, "an increment is used before it has arrived");
    return to;
  }

  void correct(const Period& p, const Correction& f) {
    const auto pose = poses_.find(next_pose_);
    expect(pose != poses_.end() && queue_.at(f.slot) == next_pose_, "a pose out of order, twice, or overwritten");
    if (pose == poses_.end()) return;
    expect(pose->second.arrival_s <= now_s() + kSame_s, "a pose corrects before it has arrived");
    for (int i = 0; i < f.count; ++i)
      horizon_s_ = walk(horizon_s_, p.advance[static_cast<std::size_t>(f.first + i)], "advance");
    expect(near(horizon_s_, pose->second.time_s), "the horizon does not end at the time of the pose");
    ++next_pose_;
  }

  /// What a new flight finds in store covers the time from the horizon to the last increment without a gap.
  void pending() {
    expect(near(schedule_.horizon_age_s(), now_s() - horizon_s_), "horizon_age_s");
    expect(near(schedule_.present_age_s(), now_s() - present_s_), "present_age_s");
    double at = horizon_s_;
    for (const Advance& a : schedule_.pending()) {
      const Increment& i = ring_[a.slot];
      expect(i.from_s <= at + kSame_s && at < i.to_s && near(a.duration_s, i.to_s - i.from_s), "pending");
      at = i.to_s;
    }
    expect(near(at, std::max(static_cast<double>(last_imu_) * kStep_s - lag_s_, horizon_s_)), "pending ends elsewhere");
  }

  Case c_;
  Schedule schedule_;
  double lag_s_, horizon_s_, present_s_, covered_s_;
  std::int64_t steps_ = 0, last_imu_ = 0, last_pushed_ = 0;
  std::uint32_t imu_ = 0, mocap_ = 0, next_pose_ = 0;
  std::map<int, Increment> ring_;
  std::vector<Increment> in_order_;
  std::optional<Increment> newest_;
  std::map<int, std::uint32_t> queue_;
  std::map<std::uint32_t, Pose> poses_;
};

TEST(Schedule, CorrectsByEveryPoseOnceAndCoversAllTime) {
  for (const int imu_hz : {500, 1000, 800, 333, 90, 10000})
    for (const int mocap_hz : test::full() ? std::vector<int>{150, 200, 240, 97, 1200} : std::vector<int>{200, 97})
      for (const double mocap_latency_s : {0.0, 0.005, 0.025, 0.030, 0.0333, 0.080})
        for (const double imu_latency_s : {0.0, 0.001, 0.003})
          for (const double low_pass_hz : {0.0, 60.0}) {
            Follower follower({imu_hz, mocap_hz, mocap_latency_s, imu_latency_s, low_pass_hz});
            for (int i = 0; i < kPeriods && follower.fault.empty(); ++i) follower.step();
            EXPECT_EQ(follower.fault, "");
            // all that arrived: those of the last latency and of the IMU's delays are still on their way
            const double end_s = kPeriods * kPeriodSteps * kStep_s - mocap_latency_s;
            EXPECT_GE(follower.corrected(), (end_s - 0.03) * mocap_hz - 2);
          }
}

TEST(Schedule, RefusesToSampleTwiceInAStep) {
  EXPECT_THROW(Schedule(sensors_of({10001, 200, 0, 0, 0}), kStep_s, kPeriodSteps), std::invalid_argument);
  EXPECT_THROW(Schedule(sensors_of({500, 5001, 0, 0, 0}), 2 * kStep_s, kPeriodSteps), std::invalid_argument);
}

TEST(Schedule, IsLateByTheLowPass) {
  // a ramp through y += a (x - y) comes out (1 - a)/a samples late
  ImuSensor imu;
  imu.rate_hz = 500;
  EXPECT_EQ(low_pass_lag_s(imu), 0);
  imu.low_pass_hz = 40;
  const double a = low_pass_share(40, 1 / imu.rate_hz);
  double y = 0;
  for (int i = 1; i <= 1000; ++i) y += a * (i / imu.rate_hz - y);
  EXPECT_NEAR(1000 / imu.rate_hz - y, low_pass_lag_s(imu), 1e-12);
  EXPECT_NEAR(a, 1 - std::exp(-2 * M_PI * 40 / 500), 1e-12);
}

}  // namespace
}  // namespace flappy::flight::schedule_test
