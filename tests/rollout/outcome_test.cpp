#include "rollout/outcome.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flappy::learn {
namespace {

using flight::Motion;
using flight::Target;

constexpr double kDegree = std::numbers::pi / 180;
const Target kGoal{{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, 1, 0, 0};

/// The escape's limits, in round numbers.
flight::Task task() {
  flight::Task t;
  t.constants.success = {0.35,
                         0.06,
                         1,
                         15,
                         std::cos(40 * kDegree),
                         std::cos(45 * kDegree),
                         0.6,
                         3,
                         0.1,
                         std::cos(45 * kDegree),
                         std::cos(45 * kDegree)};
  return t;
}

/// So far beyond the goal; everything else as asked for, but for what is given.
Motion at(double beyond_m, double heading_rad = 0, double tilt_rad = 0, double speed_m_s = 0, double rate_rad_s = 0) {
  const double ch = std::cos(heading_rad / 2), sh = std::sin(heading_rad / 2);
  const double ct = std::cos(tilt_rad / 2), st = std::sin(tilt_rad / 2);
  // roll first, then heading: the body's x axis stays level
  return {{1 + beyond_m, 0, 0}, {ch * ct, ch * st, sh * st, sh * ct}, {0, speed_m_s, 0}, {0, 0, rate_rad_s}};
}

struct Tick {
  double t_s;
  Motion motion;
  rollout::Outcome so_far = {};
};

rollout::Outcome monitored(const std::vector<Tick>& ticks) {
  rollout::OutcomeMonitor monitor(task(), at(-1), kGoal);
  rollout::Outcome o;
  for (const Tick& t : ticks) monitor.see(t.motion, kGoal, t.t_s, o = t.so_far);
  monitor.finish(o);
  return o;
}

const rollout::Outcome kCaptured{.captured_s = 0.3};
rollout::Outcome with(std::uint32_t status, std::uint32_t ended = 0) {
  rollout::Outcome o = kCaptured;
  o.status = status, o.ended = ended;
  return o;
}
rollout::Outcome lost(double t_s) {
  rollout::Outcome o = kCaptured;
  o.lost_s = t_s;
  return o;
}

TEST(OutcomeMonitor, NotesTheStrictGoal) {
  const auto reached = [](const Motion& m) { return monitored({{0.5, at(-1)}, {0.7, m}, {0.8, at(0)}}).strict_s; };
  EXPECT_EQ(reached(at(0.029)), 0.7);
  EXPECT_EQ(reached(at(-0.031)), 0.8);
  EXPECT_EQ(reached(at(0, 0, 0, 0.29)), 0.7);
  EXPECT_EQ(reached(at(0, 0, 0, 0.31)), 0.8);
  EXPECT_EQ(reached(at(0, 0, 0, 0, 4.9)), 0.7);
  EXPECT_EQ(reached(at(0, 0, 0, 0, 5.1)), 0.8);
  EXPECT_EQ(reached(at(0, 0, 19.9 * kDegree)), 0.7);
  EXPECT_EQ(reached(at(0, 0, 20.1 * kDegree)), 0.8);
  EXPECT_EQ(reached(at(0, -19.9 * kDegree)), 0.7);
  EXPECT_EQ(reached(at(0, -20.1 * kDegree)), 0.8);
  EXPECT_EQ(monitored({{0.1, at(1)}}).strict_s, 0);
}

TEST(OutcomeMonitor, MeasuresOvershootBetweenCaptureAndKeeping) {
  const std::vector<Tick> flight = {{0.1, at(0.5)},  // passed by, not captured yet
                                    {0.3, at(-0.05), kCaptured},
                                    {0.5, at(0.04), kCaptured},
                                    {0.6, at(0.07), kCaptured},
                                    {0.602, at(0.09), kCaptured}};
  EXPECT_NEAR(monitored(flight).overshoot_m, 0.07, 1e-12);
  Motion aside = at(0);
  aside.position_m[1] = 0.3;  // not along its way
  EXPECT_EQ(monitored({{0.3, at(-0.01), kCaptured}, {0.4, aside, kCaptured}}).overshoot_m, 0);
}

TEST(OutcomeMonitor, ShowsErrorsAtTheEnd) {
  const rollout::Outcome o = monitored({{2.9, at(1)}, {3, at(-0.02, -170 * kDegree, 30 * kDegree)}});
  EXPECT_NEAR(o.position_error_m, 0.02, 1e-12);
  EXPECT_NEAR(o.heading_error_rad, 170 * kDegree, 1e-12);
}

TEST(OutcomeMonitor, NamesWhatPutSuccessOutOfReach) {
  const Tick late{0.352, at(1)};
  const auto failure = [](const std::vector<Tick>& ticks) { return monitored(ticks).failure; };
  EXPECT_EQ(failure({{0.35, at(0), kCaptured}, {3, at(0), kCaptured}}), rollout::TaskFailure::none);
  EXPECT_EQ(failure({{0.35, at(1)}, late}), rollout::TaskFailure::never_captured);
  EXPECT_EQ(failure({{0.35, at(1)}}), rollout::TaskFailure::never_captured);  // and then no more ticks
  EXPECT_EQ(failure({{0.2, at(1), with(sim::kTouchedGround)}, late}), rollout::TaskFailure::crashed);
  EXPECT_EQ(failure({late, {0.5, at(1), with(sim::kTouchedGround)}}), rollout::TaskFailure::never_captured);
  EXPECT_EQ(failure({{0.4, at(0), with(sim::kTouchedWall)}}), rollout::TaskFailure::crashed);
  EXPECT_EQ(failure({{0.4, at(0), with(sim::kFrozen, flight::kNotFinite)}}), rollout::TaskFailure::not_finite);
  EXPECT_EQ(failure({{0.4, at(0), with(0, flight::kOutOfBounds)}}), rollout::TaskFailure::out_of_bounds);
  EXPECT_EQ(failure({{0.4, at(0), with(0, flight::kHeadingLate)}}), rollout::TaskFailure::too_late);
  EXPECT_EQ(failure({{0.4, at(0), with(0, flight::kArrivalLate)}}), rollout::TaskFailure::too_late);
  EXPECT_EQ(failure({{3, at(0), with(0, flight::kTimeOut)}}), rollout::TaskFailure::none);
  EXPECT_EQ(failure({{0.7, at(0.11), lost(0.7)}, {0.8, at(0, 3), lost(0.7)}}), rollout::TaskFailure::lost_position);
  EXPECT_EQ(failure({{0.7, at(0.05, 0.2, 50 * kDegree), lost(0.7)}}), rollout::TaskFailure::lost_tilt);
  EXPECT_EQ(failure({{0.7, at(0.05, 50 * kDegree, 0.2), lost(0.7)}}), rollout::TaskFailure::lost_heading);
}

TEST(OutcomeMonitor, NamesWhatWasMissingAtTheClosestMoment) {
  const auto missing = [](const Motion& closest) {
    const Motion far = at(5, 2, 2, 9, 90);
    // what comes after 0.35 s does not count
    return monitored({{0.1, far}, {0.2, closest}, {0.3, far}, {0.4, at(0.07)}}).missing;
  };
  EXPECT_EQ(missing(at(0.12, 1, 0.8, 1.5, 20)), rollout::Demand::distance);
  EXPECT_EQ(missing(at(0.07, 1, 0.8, 2, 20)), rollout::Demand::speed);
  EXPECT_EQ(missing(at(0.07, 1, 0.8, 1.1, 30)), rollout::Demand::body_rate);
  EXPECT_EQ(missing(at(0.07, 1, 2, 1.1, 20)), rollout::Demand::tilt);
  EXPECT_EQ(missing(at(0.07, 2, 0.8, 1.1, 20)), rollout::Demand::heading);
}

TEST(OutcomeMonitor, SpendsUntilHandBackOrUntilCaptureIsTooLate) {
  for (const bool hands_back : {false, true}) {
    rollout::OutcomeMonitor monitor(task(), at(-1), kGoal);
    for (int tick = 1; tick <= 300; ++tick) {
      const double t_s = 0.002 * tick;
      if (monitor.manoeuvring(t_s)) monitor.spend(0.006, 0.002, hands_back && tick == 50);
    }
    rollout::Outcome o;
    monitor.finish(o);
    EXPECT_NEAR(o.manoeuvre_s, hands_back ? 0.1 : 0.35, 1e-9);
    EXPECT_NEAR(o.energy_J, 3 * o.manoeuvre_s, 1e-9);
  }
}

TEST(Rate, HasWilsonsInterval) {
  // 8 of 10: (0.8 + z^2/20 +- z sqrt(0.016 + z^2/400)) / (1 + z^2/10) with z = 1.959964; 0 of 10: 0 to z^2/(10 + z^2)
  const rollout::Rate most = rollout::rate_of(8, 10), none = rollout::rate_of(0, 10), all = rollout::rate_of(10, 10);
  EXPECT_NEAR(most.low, 0.490162, 1e-6);
  EXPECT_NEAR(most.high, 0.943318, 1e-6);
  EXPECT_EQ(most.value, 0.8);
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 0.277533, 1e-6);
  EXPECT_NEAR(all.low, 1 - 0.277533, 1e-6);
  EXPECT_EQ(all.high, 1);
  EXPECT_EQ(rollout::rate_of(0, 0).high, 1);
}

TEST(Summary, CountsEachFlightOnce) {
  std::vector<rollout::Outcome> flights(10);
  for (std::size_t i = 0; i < 10; ++i) {
    rollout::Outcome& o = flights[i];
    o.failure = i < 6   ? rollout::TaskFailure::none
                : i < 9 ? rollout::TaskFailure::never_captured
                        : rollout::TaskFailure::lost_tilt;
    if (o.failure != rollout::TaskFailure::never_captured) o.captured_s = 0.2 + 0.01 * static_cast<double>(i);
    if (o.failure == rollout::TaskFailure::lost_tilt) o.lost_s = 1;
    o.missing = rollout::Demand::heading;
    if (i < 4) o.strict_s = 0.3;
    o.overshoot_m = o.captured_s > 0 ? 0.01 : 7;
    o.energy_J = 2, o.manoeuvre_s = 0.25;
    EXPECT_EQ(o.success(), o.failure == rollout::TaskFailure::none);
  }
  const rollout::Summary s = summarise(flights);
  EXPECT_EQ(s.flights, 10u);
  EXPECT_EQ(s.success.value, 0.6);
  EXPECT_EQ(s.captured.value, 0.7);
  EXPECT_EQ(s.strict.value, 0.4);
  EXPECT_NEAR(*s.capture_s.median, 0.23, 1e-12);  // of 0.20 ... 0.25 and 0.29
  EXPECT_NEAR(*s.capture_s.p90, 0.266, 1e-12);    // 0.9 of six steps: 0.4 of the way from 0.25 to 0.29
  EXPECT_EQ(*s.strict_s.p10, 0.3);
  EXPECT_TRUE(std::isinf(*s.strict_s.median));  // fewer than half got there
  EXPECT_EQ(*s.overshoot_m.p90, 0.01);          // not of those that never captured
  EXPECT_EQ(*s.power_W.median, 8);
  EXPECT_EQ(s.failures[static_cast<std::size_t>(rollout::TaskFailure::never_captured)], 3u);
  EXPECT_EQ(s.failures[static_cast<std::size_t>(rollout::TaskFailure::lost_tilt)], 1u);
  EXPECT_EQ(s.failures[0], 6u);
  EXPECT_EQ(s.missing[static_cast<std::size_t>(rollout::Demand::heading)], 3u);
  rollout::Outcome crashed;  // before it could capture
  crashed.failure = rollout::TaskFailure::lost_tilt, crashed.missing = rollout::Demand::heading;
  EXPECT_EQ(summarise(std::span(&crashed, 1)).missing[static_cast<std::size_t>(rollout::Demand::heading)], 0u);
  std::swap(flights[0], flights[1]);
  EXPECT_NE(summarise(flights).hash, s.hash);
  const rollout::Summary nothing = rollout::summarise(std::span<const rollout::Outcome>());
  EXPECT_EQ(nothing.flights, 0u);
  EXPECT_FALSE(nothing.capture_s.median);
}

TEST(Outcome, SucceedsOnlyUnharmed) {
  EXPECT_TRUE(kCaptured.success());
  EXPECT_TRUE(with(0, flight::kTimeOut).success());
  EXPECT_FALSE(rollout::Outcome{}.success());
  EXPECT_FALSE(lost(1).success());
  EXPECT_FALSE(with(sim::kTouchedCeiling).success());
  EXPECT_FALSE(with(0, flight::kOutOfBounds | flight::kTimeOut).success());
}

}  // namespace
}  // namespace flappy::learn
