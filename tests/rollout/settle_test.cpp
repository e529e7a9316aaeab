#include "rollout/settle.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "flight/fleets.hpp"
#include "model/effects/registry.hpp"
#include "sim/randomise.hpp"
#include "sim/storage.hpp"

namespace flappy::flight::settle_test {
namespace {

constexpr std::size_t kCount = 48;

sim::Randomisation randomisation() {
  return sim::read_randomisation(test::nominal(),
                                 io::Config::load(test::source_path("configs/randomisation/published.toml")).root());
}

/// Holds a place and heading, from settled flight there or elsewhere.
std::string holding(double x_m, double heading_rad) {
  return "schema = 1\nname = \"hold\"\nobservation = [\"position_error\", \"beat_phase\"]\n[start]\nkind = "
         "\"settled\"\n"
         "position_m = { x = " +
         std::to_string(x_m) + ", y = 0.3 }\nrotation_rad = { z = " + std::to_string(heading_rad) +
         " }\n[path]\nkind = \"waypoints\"\n" + waypoint(0, x_m, 0.3, 0, heading_rad) + kPlainTask;
}

double far_off_m(const Motion& m, const Target& t) {
  return std::hypot(m.position_m[0] - t.position_m[0], m.position_m[1] - t.position_m[1],
                    m.position_m[2] - t.position_m[2]);
}

template <class T>
void goes_on(const std::string& name) {
  const sim::Randomisation vehicles = randomisation();
  const auto vehicle = [&](std::uint32_t flapper) { return vehicles.sample({.seed = 4, .flapper = flapper}); };
  FleetOptions o = fleet_options(sensors("paper"), controller(name), task(holding(-0.2, 1.5)));
  const std::vector<Snapshot<T>> pool = rollout::settle<T>(o, kCount, 3, vehicle);
  Fleet<T> fleet(kCount, vehicle(0), o);
  for (int i = 0; i < 137; ++i) fleet.step();  // not at the beginning of any schedule
  for (std::size_t i = 0; i < kCount; ++i) fleet.start(i, 1, pool[(i + 7) % kCount]);
  for (std::size_t i = 0; i < kCount; ++i) {
    EXPECT_EQ(fleet.batch().status(i), 0u);
    EXPECT_EQ(fleet.batch().support(i), sim::Start::flying);
    EXPECT_LT(far_off_m(fleet.truth(i), fleet.target(i)), 0.03) << i;
  }
  // A fresh flight at rest falls 0.1 m before its controller has learnt its trim; a settled one goes on as it was.
  double worst = 0, angle = 0, position = 0, ticks = 0;
  for (int tick = 0; tick < 250; ++tick) {
    fleet.step();
    for (std::size_t i = 0; i < kCount; ++i) {
      worst = std::max(worst, far_off_m(fleet.truth(i), fleet.target(i)));
      if (fleet.innovation(i).second == 0) continue;
      angle += fleet.innovation(i).first, position += fleet.innovation(i).second, ++ticks;
    }
  }
  EXPECT_LT(worst, 0.02);
  // of 48 x 75 poses: 3 +- 0.04, and what flight adds
  EXPECT_NEAR(angle / ticks, 3, 0.3);
  EXPECT_NEAR(position / ticks, 3, 0.5);
}

TEST(Settle, FlightsGoOnWhereTheyArePut) {
  goes_on<float>("pid");
  goes_on<double>("arc");
}

TEST(Settle, SnapshotsDependOnTheFlapperAlone) {
  const sim::Randomisation vehicles = randomisation();
  const auto vehicle = [&](std::uint32_t flapper) {
    model::Vehicle v = vehicles.sample({.seed = 4, .flapper = flapper});
    v.driver.flapping_Hz += 0.2 * flapper;  // beats of 15 control periods, and of 14
    return v;
  };
  FleetOptions o = fleet_options(sensors("paper"), controller("pid"), task(holding(0, 0)));
  const auto all = rollout::settle<float>(o, 20, 0.3, vehicle);
  for (const std::uint32_t first : {1U, 17U}) {
    o.first_flapper = first;
    const auto some = rollout::settle<float>(o, 3, 0.3, vehicle);
    for (std::size_t i = 0; i < some.size(); ++i) {
      EXPECT_EQ(some[i].body, all[first + i].body);
      EXPECT_EQ(some[i].flight, all[first + i].flight);
      EXPECT_EQ(some[i].phase, all[first + i].phase);
    }
  }
  EXPECT_NE(all[0].phase, all[1].phase);
}

TEST(Settle, NothingIsNearTheHover) {
  FleetOptions o = fleet_options(sensors("paper"), controller("pid"), task(holding(0, 0)));
  const auto vehicle = [](std::uint32_t) {
    model::Vehicle v = test::identified();
    v.effects["ground_effect"], v.effects["ceiling_effect"], v.effects["wall_effect"];
    return v;
  };
  const auto far = rollout::settle<float>(o, 1, 0.3, vehicle);
  o.batch.world = {.ground_z_m = -0.03, .ceiling_z_m = 0.05, .walls = {{0.05, 0, -1, 0}}};
  const auto near = rollout::settle<float>(o, 1, 0.3, vehicle);
  // half a metre away, surfaces change the air's force by less than 1e-4
  for (std::size_t r = 0; r < far[0].body.size(); ++r)
    EXPECT_NEAR(near[0].body[r], far[0].body[r], 1e-4 + 1e-3 * std::abs(far[0].body[r])) << r;
}

// The weight hangs as far from the robot, in the robot's heading, and swings as it did, wherever the flight is put.
TEST(Settle, ASlungLoadComesAlong) {
  model::Vehicle v = model::read_any_vehicle(test::source_path("configs/vehicles/flapper_nimble.toml"));
  v.effects["slung_load"] = {
      {"mass_kg", 0.01}, {"length_m", 0.3}, {"moment_x_kg_m", 0}, {"moment_y_kg_m", 0}, {"z_m", -0.02}};
  FleetOptions o = fleet_options(sensors("flapper_nimble"), controller("pid_flapper_nimble"), task(holding(-20, 1.5)));
  o.batch.step_s = 1e-3;
  const auto pool = rollout::settle<double>(o, 1, 1, [&](std::uint32_t) { return v; });
  Fleet<double> there(1, v, o);
  o.task = task(holding(0, 0));
  Fleet<double> settled(1, v, o);
  settled.start(0, 1, pool[0]), there.start(0, 1, pool[0]);
  const auto hangs = [](Fleet<double>& fleet) {
    const double* const weight = sim::storage_of(fleet.batch()).hanging_weight(0);
    const auto next = static_cast<std::ptrdiff_t>(sim::kLanes<double>);
    const Motion m = fleet.truth(0);
    const double yaw = 2 * std::atan2(m.attitude[3], m.attitude[0]), c = std::cos(yaw), s = std::sin(yaw);
    const double x = weight[0] - m.position_m[0], y = weight[next] - m.position_m[1];
    const double u = weight[2 * next], w = weight[3 * next];
    return std::array{c * x + s * y, c * y - s * x, c * u + s * w, c * w - s * u};
  };
  const auto at_origin = hangs(settled), far_off = hangs(there);
  EXPECT_GT(std::hypot(at_origin[2], at_origin[3]), 1e-6) << "it swings";
  // positions of 20 m round to 4e-15, angles of small rolls and pitches to their square
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(far_off[k], at_origin[k], 1e-12) << k;
}

TEST(Trim, IsAllThatActsUntilHandedBack) {
  const std::string base = "base = \"trim\"\n";
  std::string text = holding(0, 0);
  text.insert(text.find("[start]"), base);
  text += "[hand_back]\non = \"estimate\"\nat_s = 0.1\ndistance_m = 1e-6\n";
  FleetOptions o = fleet_options(sensors("paper"), controller("pid"), task(text));
  const auto vehicle = [](std::uint32_t) { return test::identified(); };
  const auto pool = rollout::settle<double>(o, 1, 3, vehicle);
  Fleet<double> fleet(1, test::identified(), o);
  fleet.start(0, 0, pool[0]);
  sim::Input first{};
  for (int tick = 1; tick <= 80; ++tick) {
    fleet.step();
    const sim::Input u = fleet.input(0);
    if (tick == 1) first = u;
    if (tick <= 50) {  // nothing the controller sees moves it; at_s = 0.1 is the end of period 50
      EXPECT_EQ(u.amplitude_V, first.amplitude_V) << tick;
      EXPECT_EQ(u.bias_V, first.bias_V) << tick;
      EXPECT_EQ(fleet.handed_back(0), tick == 50);
    }
  }
  EXPECT_NE(fleet.input(0).bias_V, first.bias_V);
  double mean = 0;
  for (int tick = 0; tick < 500; ++tick) fleet.step(), mean += fleet.input(0).amplitude_V / 500;
  EXPECT_NEAR(first.amplitude_V, mean, 0.05);  // what carries the vehicle, but for how it bobs: 5 mm x 10 V/m
  EXPECT_GT(mean, 10.5);                       // and more than what the controller takes off with
}

/// Time and trim that a policy may observe, what closeness pays, and what keeping the goal does.
TEST(HandBack, PaysAtTheGoalAndOnceForArrivingAndForKeepingIt) {
  std::string text = holding(0, 0);
  text.insert(text.find("[start]"), "base = \"trim\"\n");
  text.replace(text.find("\"beat_phase\""), 12, "\"time\", \"trim\"");
  text.replace(text.find("alive = 1.0\nposition_1_m = 2.0"), 30,
               "until_s = 0.02\nkept = 40.0\narrival = 30.0\ngoal = 2.0\ngoal_m = 0.06\ngoal_m_s = 0.6\ngoal_rad_s = "
               "10.0\ngoal_tilt_rad = 0.5\ngoal_heading_rad = 0.8");
  text += "[hand_back]\non = \"estimate\"\nat_s = 0.1\ndistance_m = 0.05\n";
  text +=
      "[success.capture]\nby_s = 0.35\ndistance_m = 0.06\nspeed_m_s = 1.0\nbody_rate_rad_s = 15.0\ntilt_rad = "
      "0.7\nheading_rad = 0.8\n"
      "[success.keep]\nfrom_s = 0.01\nuntil_s = 0.3\ndistance_m = 0.1\ntilt_rad = 0.8\nheading_rad = 0.8\n";
  FleetOptions o = fleet_options(sensors("paper"), controller("arc"), task(text));
  const auto vehicle = [](std::uint32_t) { return test::identified(); };
  const auto pool = rollout::settle<double>(o, 1, 3, vehicle);
  Fleet<double> fleet(3, test::identified(), o);
  fleet.start(0, 0, pool[0]);
  sim::FlapperState away;
  away.position_m[0] = 1;
  fleet.start(1, 0, away, sim::Start::flying);
  away.position_m[0] = 0, away.position_m[1] = 0.3;
  away.velocity_m_s[0] = 2;
  fleet.start(2, 0, away, sim::Start::flying);
  const auto observed = fleet.observation(0);  // position error, time, trim
  EXPECT_EQ(observed[3], 0);
  double last = 0;
  for (int tick = 1; tick <= 12; ++tick) {
    fleet.step();
    if (tick == 1) {
      EXPECT_TRUE(fleet.handed_back(0));  // at the goal from the start
      EXPECT_NEAR(fleet.observation(0)[3], 0.002, 1e-15);
      const sim::Input u = fleet.input(0);  // of which the trim is all, until then
      const double learnt[] = {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
      for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(observed[4 + k], learnt[k], 1e-9);
    }
    // 2 G, which moves by some per cent within a period of the beat; 30 G more at the hand-back; kept at 0.02 s, the tenth tick
    const double reward = (fleet.reward(0) - (tick == 10 ? 40 : 0)) / (tick == 1 ? 16 : 1);
    EXPECT_GT(reward, 0.5) << tick;
    EXPECT_LT(reward, 2) << tick;
    if (tick > 1) EXPECT_NEAR(reward, last, 0.2 * last) << tick;
    last = reward;
    EXPECT_TRUE(fleet.handed_back(2));  // while it rushes through the goal
    if (tick > 1) EXPECT_EQ(fleet.reward(2), 0) << tick;
    else EXPECT_GT(fleet.reward(2), 0) << tick;
    EXPECT_LT(fleet.reward(1), 0.01) << tick;  // never captured, so it keeps nothing
    EXPECT_GT(fleet.reward(1), 0) << tick;
  }
}

/// One that has every effect but the tether, whose line would be a kilometre long here.
model::Vehicle affected(model::Vehicle v) {
  for (const model::CatalogueEffect& e : model::effects())
    if (e.info.id != std::string_view("tether")) v.effects[e.info.id] = {};
  return v;
}

TEST(Snapshot, HoldsWhatEffectsRemember) {
  const FleetOptions o = fleet_options(sensors("code"), controller("pid"), task(holding(0, 0)));
  Fleet<float> from(3, affected(test::identified()), o), to(20, test::identified(), o),
      plain(20, test::identified(), o);
  for (int i = 0; i < 40; ++i) from.step();
  const Snapshot<float> snapshot = from.snapshot(2);
  to.start(17, 1, snapshot);
  const Snapshot<float> again = to.snapshot(17);
  EXPECT_EQ(again.effects, snapshot.effects);
  EXPECT_NE(again.effects, 0u);
  EXPECT_EQ(again.effect_rows, snapshot.effect_rows);
  EXPECT_EQ(again.effect_states, snapshot.effect_states);
  EXPECT_GT(std::ranges::count_if(snapshot.effect_states, [](float x) { return x != 0; }), 100);
  // and leaves the others alone
  for (int i = 0; i < 40; ++i) to.step(), plain.step();
  EXPECT_EQ(to.hash(0, 17), plain.hash(0, 17));
  EXPECT_EQ(to.hash(18, 20), plain.hash(18, 20));
  EXPECT_NE(to.snapshot(17).effect_states, snapshot.effect_states);
  to.start(17, 2, plain.snapshot(3));  // over what it had
  EXPECT_EQ(to.snapshot(17).effects, 0u);
}

TEST(Fleet, FliesOnFromItsMemory) {
  const sim::Randomisation vehicles = randomisation();
  const auto vehicle = [&](std::uint32_t flapper) {
    return affected(vehicles.sample({.seed = 4, .flapper = flapper}));
  };
  const FleetOptions o = fleet_options(sensors("code"), controller("pid"), task(holding(0.1, 0)));
  const auto pool = rollout::settle<float>(o, 20, 0.5, vehicle);
  Fleet<float> one(20, vehicle(0), o), other(20, vehicle(0), o);
  for (std::size_t i = 0; i < 20; ++i) one.start(i, 0, pool[i]);
  for (int i = 0; i < 33; ++i) one.step();
  const auto from = one.memory(), to = other.memory();
  ASSERT_EQ(from.size(), to.size());
  for (std::size_t k = 0; k < from.size(); ++k) std::copy(from[k].begin(), from[k].end(), to[k].begin());
  other.restored(one.periods());
  for (int i = 0; i < 35; ++i) one.step();
  for (int group = 0; group < 7; ++group) {  // in parts, blocks last first
    other.begin(5);
    for (std::size_t b = other.blocks(); b-- > 0;) other.fly_block(b);
    other.end();
  }
  EXPECT_EQ(one.hash(), other.hash());
  EXPECT_EQ(other.periods(), 68);
}

TEST(Success, NotesCaptureAndLossOnTheTrueState) {
  const std::string success =
      "[success.capture]\nby_s = 0.35\ndistance_m = 0.06\nspeed_m_s = 1.0\nbody_rate_rad_s = 15.0\ntilt_rad = "
      "0.7\nheading_rad = "
      "0.8\n"
      "[success.keep]\nfrom_s = 0.1\nuntil_s = 0.3\ndistance_m = 0.1\ntilt_rad = 0.8\nheading_rad = 0.8\n";
  FleetOptions o = fleet_options(sensors("paper"), controller("none"), task(staying() + success));
  Fleet<double> fleet(3, test::nominal(), o);
  sim::FlapperState s;
  s.velocity_m_s[2] = 0.5;  // thrown up: back at the goal by 0.1 s, 0.29 m below it by 0.3 s
  fleet.start(0, 0, s, sim::Start::flying);
  s.attitude[0] = 0, s.attitude[3] = 1;  // the same, looking away
  fleet.start(1, 0, s, sim::Start::flying);
  s = {};
  s.position_m[0] = 0.2;  // never there
  fleet.start(2, 0, s, sim::Start::flying);
  for (int tick = 0; tick < 200; ++tick) fleet.step();
  EXPECT_NEAR(fleet.captured_s(0), 0.002, 1e-9);
  EXPECT_NEAR(fleet.lost_s(0), 0.204, 0.03);  // 0.5 t - g/2 t^2 = -0.1, but for the air
  EXPECT_EQ(fleet.captured_s(1), 0);
  EXPECT_NEAR(fleet.lost_s(1), 0.1, 1e-9);  // the first sample that is asked for
  EXPECT_EQ(fleet.captured_s(2), 0);
  EXPECT_NEAR(fleet.lost_s(2), 0.1, 1e-9);
}

}  // namespace
}  // namespace flappy::flight::settle_test
