// Recorded pieces of flights, flown once more: against the batch that flew them, and against each other.
#include "sim/replay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::sim::replay_test {
namespace {

constexpr double kStep = 1e-4;

/// A flight as the batch flew it: the state after every millisecond, and the voltages held in the one after it.
struct Recorded {
  std::vector<FlapperState> states;
  VoltageScript voltages;
  FlapperState at(double t_s) const { return states[static_cast<std::size_t>(std::lround(t_s * 1e3))]; }
};

Recorded fly(const model::Vehicle& vehicle, int milliseconds, double difference_V = 0) {
  BatchOptions o;
  o.step_s = kStep;
  o.threads = 1;
  Batch<double> batch(1, vehicle, o);
  FlapperState start;
  start.position_m[2] = 1;
  batch.reset(0, start);
  Recorded r;
  for (int ms = 0; ms < milliseconds; ++ms) {
    batch.set_input(0, {11.5 + std::sin(0.05 * ms), difference_V - 0.3 + 0.2 * std::sin(0.11 * ms), -0.1, 0.01});
    r.states.push_back(batch.state(0));
    batch.step(10);
    const auto v = get<Drive<double>>(storage_of(batch).blocks[0].drive, 0).voltages;
    r.voltages.t_s.push_back(ms * 1e-3);
    r.voltages.left_V.push_back(v.left_V);
    r.voltages.right_V.push_back(v.right_V);
  }
  r.states.push_back(batch.state(0));
  return r;
}

double largest_difference(const FlapperState& a, const FlapperState& b) {
  double difference = 0;
  const auto* x = reinterpret_cast<const double*>(&a);
  const auto* y = reinterpret_cast<const double*>(&b);
  for (std::size_t i = 0; i < sizeof a / sizeof(double); ++i) difference = std::max(difference, std::abs(x[i] - y[i]));
  return difference;
}

bool same_bits(const FlapperState& a, const FlapperState& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

ReplayOptions options(int threads = 1) {
  ReplayOptions o;
  o.step_s = kStep;
  o.threads = threads;
  return o;
}

TEST(Replay, FromTheStartGivesTheBitsOfTheFlight) {
  const model::Vehicle vehicle = test::identified();
  const Recorded r = fly(vehicle, 60);
  std::vector<int> checkpoints;  // as often as the flight was looked at, for every look rounds
  for (int ms = 1; ms <= 60; ++ms) checkpoints.push_back(10 * ms);
  const auto results = replay(
      {{0, &vehicle, &r.voltages}}, checkpoints, [&](std::size_t, double t_s) { return r.at(t_s); }, options());
  for (std::size_t ms = 1; ms <= 60; ++ms) EXPECT_TRUE(same_bits(results[0].states[ms - 1], r.states[ms])) << ms;
  EXPECT_FALSE(same_bits(r.states[59], r.states[60]));
  EXPECT_EQ(results[0].status, 0u);
}

TEST(Replay, FromWithinGivesTheFlightToRounding) {
  // A state passes through the torso's velocity, which rounds to 1e-16 of some m/s and 1e3 rad/s; landings on stops and the
  // sign of friction magnify that. 2e-8 is what remains of 1e-13 after 30 of them, each by at most 1.5.
  const model::Vehicle vehicle = test::identified();
  const Recorded r = fly(vehicle, 200);
  std::vector<ReplayWindow> windows;
  for (int ms = 0; ms < 100; ms += 7) windows.push_back({ms * 1e-3, &vehicle, &r.voltages});
  const auto results = replay(
      windows, {590}, [&](std::size_t, double t_s) { return r.at(t_s); }, options());
  for (std::size_t i = 0; i < windows.size(); ++i)
    EXPECT_LT(largest_difference(results[i].states[0], r.at(windows[i].start_s + 0.059)), 2e-8) << i;
}

TEST(Replay, WindowsDoNotSeeEachOtherOrTheThreads) {
  model::Vehicle one = test::identified(), heavy = test::nominal(), dragged = test::identified();
  heavy.torso.mass_kg *= 1.1;
  dragged.effects["body_drag"];
  const Recorded r = fly(one, 300, 0.1);
  VoltageScript wild = r.voltages;
  for (double& v : wild.left_V) v = std::numeric_limits<double>::quiet_NaN();
  const auto recorded = [&](std::size_t, double t_s) { return r.at(t_s); };
  ReplayOptions o = options();
  o.spin_up_steps = 300;
  std::vector<ReplayWindow> windows;
  for (int i = 0; i < 21; ++i)
    windows.push_back({0.05 + 0.003 * i,
                       i % 3 == 1   ? &heavy
                       : i % 5 == 2 ? &dragged
                                    : &one,
                       i == 3 ? &wild : &r.voltages});
  const auto together = replay(windows, {100, 300}, recorded, o);
  EXPECT_NE(together[3].status & kFrozen, 0u);
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const auto alone = replay(
        {windows[i]}, {100, 300}, [&](std::size_t, double t_s) { return r.at(t_s); }, o);
    EXPECT_TRUE(same_bits(alone[0].states[1], together[i].states[1])) << i;
    EXPECT_EQ(alone[0].status, together[i].status);
  }
  EXPECT_FALSE(same_bits(together[0].states[1], together[8].states[1]));
  for (const int threads : {2, 3, 7}) {
    o.threads = threads;
    const auto again = replay(windows, {100, 300}, recorded, o);
    for (std::size_t i = 0; i < windows.size(); ++i) EXPECT_TRUE(same_bits(again[i].states[1], together[i].states[1]));
  }
  for (const std::string& set : instruction_sets()) {
    o.instruction_set = set;
    const auto again = replay(windows, {100, 300}, recorded, o);
    for (std::size_t i = 0; i < windows.size(); ++i)
      EXPECT_TRUE(same_bits(again[i].states[1], together[i].states[1])) << set << i;
  }
}

TEST(Replay, AVoltageCountsForItsShareOfAStep) {
  const model::Vehicle vehicle = test::nominal();
  const auto at_rest = [](std::size_t, double) { return FlapperState{}; };
  const auto end = [&](const VoltageScript& script, double start_s) {
    return replay({{start_s, &vehicle, &script}}, {30}, at_rest, options())[0].states[0];
  };
  // two changes within step 10, which so has 0.2 x 4 + 0.5 x 8 + 0.3 x 2 = 5.4 V
  const VoltageScript within{{0, 1.02e-3, 1.07e-3}, {4, 8, 2}, {4, 8, 2}};
  const VoltageScript means{{0, 1e-3, 1.1e-3}, {4, 5.4, 2}, {4, 5.4, 2}};
  // the mean is rounded: 1e-15 V for 20 steps, in accelerations of some 1e5 rad/s^2
  EXPECT_LT(largest_difference(end(within, 0), end(means, 0)), 1e-9);
  // the ends of steps are not exact: 3 x 0.1 ms is not 0.3 ms
  const VoltageScript rounded{{0, 3e-4 * (1 - 1e-15), 6e-4 * (1 + 1e-15)}, {4, 8, 2}, {4, 8, 2}};
  const VoltageScript exact{{0, 3e-4, 6e-4}, {4, 8, 2}, {4, 8, 2}};
  EXPECT_TRUE(same_bits(end(rounded, 0), end(exact, 0)));
  EXPECT_FALSE(same_bits(end(within, 0), end(exact, 0)));
  // shifted in time as a whole, nothing changes; before the first voltage there is the first
  const VoltageScript later{{5, 5.0003, 5.0006}, {4, 8, 2}, {4, 8, 2}};
  EXPECT_TRUE(same_bits(end(later, 5), end(exact, 0)));
  const VoltageScript late_start{{2e-4, 3e-4, 6e-4}, {4, 8, 2}, {4, 8, 2}};
  EXPECT_TRUE(same_bits(end(late_start, 0), end(exact, 0)));
}

TEST(Replay, CarriedWingsComeIntoPhaseWeldedOnesDoNot) {
  const model::Vehicle vehicle = test::identified();
  const Recorded r = fly(vehicle, 250);
  std::vector<ReplayWindow> windows;
  for (int ms = 100; ms < 130; ms += 3) windows.push_back({ms * 1e-3, &vehicle, &r.voltages});
  const auto wings_off = [&](int beats, int carry) {
    ReplayOptions o = options();
    o.spin_up_steps = beats * 290;
    o.carry_steps = carry;
    const auto results = replay(
        windows, {0}, [&](std::size_t, double t_s) { return r.at(t_s); }, o);
    double worst = 0;
    for (std::size_t i = 0; i < windows.size(); ++i)
      for (int side = 0; side < 2; ++side)
        worst = std::max(worst,
                         std::abs(results[i].states[0].stroke_rad[side] - r.at(windows[i].start_s).stroke_rad[side]));
    return worst;
  };
  EXPECT_LT(wings_off(3, 10), 2e-3);  // what rest was is forgotten by a factor of about 15 in each beat
  EXPECT_GT(wings_off(1, 10), 10 * wings_off(3, 10));
  EXPECT_NEAR(wings_off(3, 0), 0.037, 0.004);  // 3 % of the stroke; let loose it would be 0.045
}

TEST(Replay, StrokesFollowTheirRecord) {
  // flown by motors that pull less, but recorded from those that pull more: a tenth of the difference at every millisecond
  model::Vehicle weak = test::identified();
  weak.left.motor.resistance_ohm *= 1.1;
  const Recorded r = fly(test::identified(), 250);
  std::vector<ReplayWindow> windows;
  for (int ms = 100; ms < 160; ++ms) windows.push_back({ms * 1e-3, &weak, &r.voltages});
  const auto stroke_off = [&](double share, bool seen, int side) {
    ReplayOptions o = options();
    o.spin_up_steps = 870;
    o.stroke_share = share;
    const auto results = replay(
        windows, {0},
        [&](std::size_t, double t_s) {
          FlapperState x = r.at(t_s);
          if (!seen) x.stroke_rad[0] = x.stroke_rad[1] = std::numeric_limits<double>::quiet_NaN();
          return x;
        },
        o);
    double sum = 0;
    for (std::size_t i = 0; i < windows.size(); ++i)
      sum += std::abs(results[i].states[0].stroke_rad[side] - r.at(windows[i].start_s).stroke_rad[side]);
    return sum / static_cast<double>(windows.size());
  };
  EXPECT_LT(stroke_off(0.4, true, 0), 0.2 * stroke_off(0, true, 0));  // the rate alone gives 0.4
  EXPECT_LT(stroke_off(0.4, true, 1), 2e-3);
  EXPECT_EQ(stroke_off(0.4, false, 0), stroke_off(0, true, 0));
}

TEST(Replay, RefusesWhatMakesNoSense) {
  const model::Vehicle vehicle = test::nominal();
  const VoltageScript script{{0}, {1}, {1}}, none;
  const auto at_rest = [](std::size_t, double) { return FlapperState{}; };
  EXPECT_THROW(replay({{0, &vehicle, &script}}, {}, at_rest, options()), std::invalid_argument);
  EXPECT_THROW(replay({{0, &vehicle, &script}}, {20, 10}, at_rest, options()), std::invalid_argument);
  EXPECT_THROW(replay({{0, &vehicle, &none}}, {10}, at_rest, options()), std::invalid_argument);
  ReplayOptions o = options(2);
  o.carry_steps = -1;
  EXPECT_THROW(replay({{0, &vehicle, &script}}, {10}, at_rest, o), std::invalid_argument);
  const auto fails = [](std::size_t, double) -> FlapperState { throw std::runtime_error("no state"); };
  EXPECT_THROW(replay({{0, &vehicle, &script}}, {10}, fails, options(2)), std::runtime_error);
  EXPECT_TRUE(replay({}, {10}, at_rest, options()).empty());
}

}  // namespace
}  // namespace flappy::sim::replay_test
