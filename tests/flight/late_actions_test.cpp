// Actions that act later than the policy took them: by draws that no processor changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flight/fleets.hpp"
#include "refusal.hpp"

namespace flappy::flight::late_actions_test {
namespace {

/// A policy that acts every 10 ms on a robot without a controller. Actions of 1, 0 and -1 are 9, 5 and 1 V.
Task late_task(const std::string& jitter) {
  std::string text = staying();
  text.replace(text.find("[-5.0, 5.0]"), 11, "[1.0, 9.0]");
  return task(text.replace(text.find("[action]"), 8, "[action]\nrepeat_s = 0.01\n" + jitter));
}
FleetOptions late_options(const std::string& jitter = "jitter_s = 0.008\n") {
  return fleet_options(sensors("paper"), controller("none"), late_task(jitter));
}
constexpr float kVolts = 4, kMiddle_V = 5;

void start(Fleet<float>& fleet, std::size_t flappers, std::uint32_t episode = 0) {
  for (std::size_t i = 0; i < flappers; ++i) fleet.start(i, episode, {.position_m = {0, 0, 0.4}}, sim::Start::flying);
}

/// All actions of a fleet's flappers alike.
void act_alike(Fleet<float>& fleet, std::size_t flappers, float value) {
  const std::vector<float> actions(flappers * 4, value);
  for (std::size_t b = 0; b < fleet.blocks(); ++b) fleet.set_actions(b, &actions[fleet.flappers(b).first * 4]);
}

/// [flapper] In how many of the five control periods of an action the one before it acted.
std::vector<std::size_t> periods_late(Fleet<float>& fleet, std::size_t flappers, float before, float now) {
  std::vector<std::size_t> late(flappers, 0U);
  for (std::size_t period = 0; period < 5; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < flappers; ++i) {
      const double volts = fleet.input(i).amplitude_V;
      if (std::abs(volts - (kMiddle_V + kVolts * before)) < 1e-5) late[i] = period + 1;
      else EXPECT_NEAR(volts, kMiddle_V + kVolts * now, 1e-5) << "neither the action before nor the present one";
    }
  }
  return late;
}

// Each of the five numbers of control periods is drawn 256 times of 1,280: the standard deviation is 14.
TEST(LateActions, AreLateByADrawOfTheirOwn) {
  constexpr std::size_t kFlappers = 64;
  Fleet<float> fleet(kFlappers, test::nominal(), late_options());
  start(fleet, kFlappers);
  std::vector<std::size_t> of(6);
  float before = 0;  // the robot starts with the middle of the range
  for (int n = 0; n < 20; ++n) {
    const float now = n % 2 == 0 ? 0.8F : -0.8F;
    act_alike(fleet, kFlappers, now);
    for (const std::size_t periods : periods_late(fleet, kFlappers, before, now)) ++of[periods];
    before = now;
  }
  for (std::size_t periods = 0; periods < 5; ++periods)
    EXPECT_NEAR(static_cast<double>(of[periods]), 256, 60) << periods;
  EXPECT_EQ(of[5], 0U) << "each action acts before the next";
  for (const std::size_t periods : periods_late(fleet, kFlappers, 0.5F, before))
    EXPECT_EQ(periods, 0U) << "without a new action the last one goes on";
  start(fleet, kFlappers, 1);
  act_alike(fleet, kFlappers, 0.3F);
  periods_late(fleet, kFlappers, 0, 0.3F);  // after a new start, no action of the flight before acts
}

// Each flight draws a largest delay from 0 to 4 control periods. No action of the flight is later, and some are as late.
TEST(LateActions, MayHaveALargestDelayOfEachFlight) {
  constexpr std::size_t kFlappers = 512;
  FleetOptions options = late_options();
  options.task.action_late_drawn = true;
  Fleet<float> fleet(kFlappers, test::nominal(), options);
  const auto latest_of = [&](std::uint32_t episode) {
    start(fleet, kFlappers, episode);
    std::vector<std::size_t> latest(kFlappers);
    float before = 0;
    for (int n = 0; n < 30; ++n) {
      const float now = n % 2 == 0 ? 0.8F : -0.8F;
      act_alike(fleet, kFlappers, now);
      const std::vector<std::size_t> late = periods_late(fleet, kFlappers, before, now);
      for (std::size_t i = 0; i < kFlappers; ++i) latest[i] = std::max(latest[i], late[i]);
      before = now;
    }
    return latest;
  };
  const std::vector<std::size_t> one = latest_of(0), other = latest_of(1);
  std::vector<std::size_t> flights(6);
  for (const std::size_t periods : one) ++flights[periods];
  // in 30 draws the largest of five numbers is missed in 1 of 800 flights; a standard deviation is 9
  for (std::size_t periods = 0; periods < 5; ++periods)
    EXPECT_NEAR(static_cast<double>(flights[periods]), kFlappers / 5.0, 36) << periods;
  std::size_t same = 0;  // a flapper draws anew for each flight
  for (std::size_t i = 0; i < kFlappers; ++i) same += one[i] == other[i] ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(same), kFlappers / 5.0, 36);
}

TEST(LateActions, ArePartOfHashAndMemory) {
  const FleetOptions o = late_options();
  Fleet<float> a(20, test::nominal(), o), b(20, test::nominal(), o);
  start(a, 20);
  act_alike(a, 20, 0.5F);
  for (int period = 0; period < 5; ++period) a.step();
  act_alike(a, 20, -0.5F);
  a.step();
  const auto from = a.memory(), to = b.memory();
  ASSERT_EQ(from.size(), to.size());
  for (std::size_t k = 0; k < from.size(); ++k) std::ranges::copy(from[k], to[k].begin());
  b.restored(a.periods());
  EXPECT_EQ(a.hash(), b.hash());
  for (int period = 0; period < 4; ++period) a.step(), b.step();
  EXPECT_EQ(a.hash(), b.hash());
}

TEST(LateActions, AreLateAlikeOnEveryInstructionSet) {
  const auto hash = [](const std::string& set, const std::string& jitter, bool drawn = false) {
    FleetOptions o = late_options(jitter);
    o.task.action_late_drawn = drawn;
    o.batch.instruction_set = set;
    Fleet<float> fleet(20, test::nominal(), o);
    start(fleet, 20);
    for (int n = 0; n < 10; ++n) {
      act_alike(fleet, 20, 0.1F * static_cast<float>(n));
      for (int period = 0; period < 5; ++period) fleet.step();
    }
    return fleet.hash();
  };
  const std::vector<std::string> sets = sim::instruction_sets();
  for (const bool drawn : {false, true})
    for (const std::string& set : sets)
      EXPECT_EQ(hash(set, "jitter_s = 0.006\n", drawn), hash(sets[0], "jitter_s = 0.006\n", drawn)) << set;
  EXPECT_NE(hash("", "jitter_s = 0.006\n", true), hash("", "jitter_s = 0.006\n"));
  EXPECT_EQ(hash("", "jitter_s = 0.0\n"), hash("", ""));
  EXPECT_NE(hash("", "jitter_s = 0.006\n"), hash("", ""));
}

TEST(LateActions, ActBeforeTheNextOne) {
  EXPECT_EQ(test::refusal([] { late_task("jitter_s = 0.01\n"); }),
            "task.toml:17:12: action.jitter_s: lets an action come after the next one; accepted: less than "
            "action.repeat_s, 0.01 s");
  EXPECT_EQ(test::refusal([] { late_task("jitter_s = 0.003\n"); }),
            "task.toml:17:12: action.jitter_s: is no whole number of control periods; accepted: n x 0.002 s");
}

}  // namespace
}  // namespace flappy::flight::late_actions_test
