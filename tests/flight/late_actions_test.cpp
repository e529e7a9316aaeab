// Actions that act later than the policy took them: by draws that no processor changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flight/fleets.hpp"
#include "refusal.hpp"

namespace flappy::flight::late_actions_test {
namespace {

/// A policy that acts every 10 ms on a robot without a controller.
Task late_task(const std::string& jitter) {
  std::string text = staying();
  return task(text.replace(text.find("[action]"), 8, "[action]\nrepeat_s = 0.01\n" + jitter));
}

/// All actions of a fleet's flappers alike.
template <class T>
void act_alike(Fleet<T>& fleet, std::size_t count, T value) {
  const std::vector<T> actions(count * 4, value);
  for (std::size_t b = 0; b < fleet.blocks(); ++b) fleet.set_actions(b, &actions[fleet.flappers(b).first * 4]);
}

// Each of the five numbers of control periods is drawn 256 times of 1,280: the standard deviation is 14.
TEST(LateActions, AreLateByADrawOfTheirOwn) {
  constexpr std::size_t kFlappers = 64;
  Fleet<float> fleet(kFlappers, test::nominal(),
                     fleet_options(sensors("paper"), controller("none"), late_task("jitter_s = 0.008\n")));
  for (std::size_t i = 0; i < kFlappers; ++i) fleet.start(i, 0, {.position_m = {0, 0, 0.4}}, sim::Start::flying);
  std::vector<std::size_t> late(kFlappers), of(6);
  float before = 0;  // the robot starts with the middle of the range
  for (int n = 0; n < 20; ++n) {
    const float now = n % 2 == 0 ? 0.8F : -0.8F;
    act_alike(fleet, kFlappers, now);
    std::ranges::fill(late, 0U);
    for (int period = 0; period < 5; ++period) {
      fleet.step();
      for (std::size_t i = 0; i < kFlappers; ++i) {
        const double volts = fleet.input(i).amplitude_V;
        if (std::abs(volts - 5.0 * before) < 1e-5) late[i] = static_cast<std::size_t>(period) + 1;
        else EXPECT_NEAR(volts, 5.0 * now, 1e-5) << "neither the action before nor the present one";
      }
    }
    for (const std::size_t periods : late) ++of[periods];
    before = now;
  }
  for (std::size_t periods = 0; periods < 5; ++periods)
    EXPECT_NEAR(static_cast<double>(of[periods]), 256, 60) << periods;
  EXPECT_EQ(of[5], 0U) << "each action acts before the next";
}

TEST(LateActions, AreLateAlikeOnEveryInstructionSet) {
  const auto hash = [](const std::string& set, const std::string& jitter) {
    FleetOptions o = fleet_options(sensors("paper"), controller("none"), late_task(jitter));
    o.batch.instruction_set = set;
    Fleet<float> fleet(20, test::nominal(), o);
    for (std::size_t i = 0; i < 20; ++i) fleet.start(i, 0, {.position_m = {0, 0, 0.4}}, sim::Start::flying);
    for (int n = 0; n < 10; ++n) {
      act_alike(fleet, 20, 0.1F * static_cast<float>(n));
      for (int period = 0; period < 5; ++period) fleet.step();
    }
    return fleet.hash();
  };
  const std::vector<std::string> sets = sim::instruction_sets();
  for (const std::string& set : sets)
    EXPECT_EQ(hash(set, "jitter_s = 0.006\n"), hash(sets[0], "jitter_s = 0.006\n")) << set;
  EXPECT_EQ(hash("", "jitter_s = 0.0\n"), hash("", ""));
  EXPECT_NE(hash("", "jitter_s = 0.006\n"), hash("", ""));
}

TEST(LateActions, ActBeforeTheNextOne) {
  EXPECT_EQ(test::refusal([] { late_task("jitter_s = 0.01\n"); }),
            "task.toml:17:12: action.jitter_s: lets an action come after the next one; accepted: 0 to 0.008 s");
  EXPECT_EQ(test::refusal([] { late_task("jitter_s = 0.003\n"); }),
            "task.toml:17:12: action.jitter_s: is no whole number of control periods; accepted: n x 0.002 s");
}

}  // namespace
}  // namespace flappy::flight::late_actions_test
