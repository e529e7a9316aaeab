// The blind robot under a policy: what the policy is shown and when, when its work is done, and what is a success.
#include <gtest/gtest.h>

#include <cmath>

#include "flight/constants.hpp"
#include "full.hpp"
#include "lab/blind/a/a_escape.hpp"
#include "rollout/fly_config.hpp"
#include "vehicles.hpp"

namespace flappy::blind::escape_test {
namespace {

Case identified() {
  Case c{.vehicle = test::identified(), .vehicle_file = "hummingbird_identified.toml"};
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  c.seed = 4;
  return c;
}

EscapeRules shipped(ObservationPolicy policy) {
  const rollout::FlyConfig config = rollout::read_fly_config(test::source_path("configs/fly/escape.toml"));
  const flight::FlightConstants k = flight::flight_constants(config.fleet);
  return {config.fleet.task, k.task, k.controller.of<flight::PidController>(), std::move(policy)};
}

using Rows = std::vector<std::vector<double>>;

/// A policy that adds nothing to the trim, and notes what it sees.
ObservationPolicy watcher(Rows& seen) {
  return [&seen](const std::vector<double>& observation) {
    seen.push_back(observation);
    return std::array<double, 4>{};
  };
}

std::size_t command_at(const Escape& e, double t_s) {
  const flightlog::Column& t = e.flight.log.command.t_s;
  return static_cast<std::size_t>(std::ranges::lower_bound(t, t_s - 1e-9) - t.begin());
}
double amplitude_at(const Escape& e, double t_s) {
  return e.flight.log.command.inputs->amplitude_V[command_at(e, t_s)];
}

TEST(Escape, ThePolicySeesWhatItWasTrainedWith) {
  Rows seen;
  const EscapeRules rules = shipped(watcher(seen));
  const Escape e = escape(identified(), 0, rules);
  // every 10 ms until it hands back for good at 0.35 s, for it never arrives
  ASSERT_EQ(seen.size(), 35u);
  const std::vector<flight::Signal> signals = rules.task.observation();
  ASSERT_EQ(seen[0].size(), signals.size());
  const auto value = [&](std::size_t call, const std::string& name) {
    const auto at = std::ranges::find(signals, name, &flight::Signal::name);
    EXPECT_NE(at, signals.end()) << name;
    return seen[call][static_cast<std::size_t>(at - signals.begin())];
  };
  // where the task starts it, but for the 5 mm and 0.05 rad of hover
  EXPECT_GT(value(0, "x_error"), -0.215);
  EXPECT_LT(value(0, "x_error"), -0.175);
  EXPECT_LT(std::abs(value(0, "y_error")), 0.055);
  EXPECT_LT(std::abs(value(0, "z_error")), 0.055);
  EXPECT_LT(value(0, "goal_R_xx"), -0.95);                       // its tail to the goal
  EXPECT_EQ(value(0, "trim_amplitude"), amplitude_at(e, 0.05));  // to which it adds nothing
  EXPECT_EQ(value(0, "added_amplitude"), 1.5);                   // the middle of what may be added, before it acts
  EXPECT_EQ(value(1, "added_amplitude"), 0);
  EXPECT_EQ(value(20, "trim_bias"), value(0, "trim_bias"));  // held while it acts
  for (const std::size_t call : {0u, 7u, 34u}) {
    const double t_s = 0.01 * static_cast<double>(call);
    EXPECT_NEAR(value(call, "time"), t_s, 1e-9);
    const double phase_rad = (*e.flight.log.command.phase_rad)[command_at(e, t_s)];
    EXPECT_NEAR(value(call, "beat_cos"), std::cos(phase_rad), 1e-9) << call;
    EXPECT_NEAR(value(call, "beat_sin"), std::sin(phase_rad), 1e-9) << call;
  }
  EXPECT_EQ(e.captured_s, 0) << "the controller alone comes too late";
}

TEST(Escape, WhatIsAddedFliesUntilTheHandBack) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Rows seen;
  const Escape plain = escape(identified(), 0, shipped(watcher(seen)));
  const Escape more = escape(identified(), 0, shipped([](const std::vector<double>&) {
                               return std::array<double, 4>{2, 0, 0, 0};
                             }));
  for (const double t_s : {0.0, 0.05, 0.34})
    EXPECT_NEAR(amplitude_at(more, t_s) - amplitude_at(plain, t_s), 2, 1e-12) << t_s;
  EXPECT_EQ(amplitude_at(more, 0.34), amplitude_at(more, 0.05));      // the trim stays as it was learnt
  EXPECT_LT(amplitude_at(more, 0.36), amplitude_at(more, 0.05) - 1);  // it has climbed: the controller brings it down
}

TEST(Escape, ASuccessIsCaptureAndKeeping) {
  Rows seen;
  EscapeRules rules = shipped(watcher(seen));
  for (flight::Spread& s : rules.task.start.position_m) s = {0, 0};
  rules.task.start.x_low_m = -1, rules.task.start.x_high_m = 1;
  rules.task.start.rotation_rad[2] = {0, 0};
  const Escape there = escape(identified(), 1, rules);
  EXPECT_GT(there.captured_s, 0);
  EXPECT_LE(there.captured_s, 0.03);  // as soon as a beat's nodding allows
  EXPECT_EQ(there.lost_s, 0);
  EXPECT_EQ(there.ended & ~std::uint32_t{flight::kTimeOut}, 0u);
  EXPECT_LE(seen.size(), 4u);  // and it hands back at once
  rules.constants.success.keep_distance_m = 1e-4;
  EXPECT_NEAR(escape(identified(), 1, rules).lost_s, 0.6, 0.1);
  rules.constants.limits.distance_m = 1e-4;
  EXPECT_NE(escape(identified(), 1, rules).ended & flight::kOutOfBounds, 0u);
}

TEST(Escape, SameCaseSameBytesAnotherStartEachTime) {
  Rows seen;
  const EscapeRules rules = shipped(watcher(seen));
  const Escape a = escape(identified(), 2, rules), b = escape(identified(), 2, rules);
  EXPECT_EQ(a.flight.truth, b.flight.truth);
  EXPECT_EQ(flightlog::flight_log_files(a.flight.log), flightlog::flight_log_files(b.flight.log));
  EXPECT_GT(std::abs(escape(identified(), 3, rules).flight.truth[2][0] - a.flight.truth[2][0]), 1e-3);
}

}  // namespace
}  // namespace flappy::blind::escape_test
