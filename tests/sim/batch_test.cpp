// The batch as its user sees it: starts, support, contact, freezing, effects.
#include "flappy/batch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "model/wing_beat.hpp"
#include "sim/lanes.hpp"
#include "vehicles.hpp"

namespace flappy::sim::batch_test {
namespace {

constexpr double kStep = 1e-4;

BatchOptions one_thread(World world = {}) {
  BatchOptions o;
  o.step_s = kStep;
  o.threads = 1;
  o.world = std::move(world);
  return o;
}

World ground_at(double z) {
  World w;
  w.ground_z_m = z;
  return w;
}

TEST(Batch, FitsItsBudget) {
  EXPECT_LE(Batch<float>::bytes_per_flapper(), 2048u);
  EXPECT_GE(Batch<float>::bytes_per_flapper(), 400u);  // there is something in it
}

TEST(Batch, RefusesWhatMakesNoSense) {
  BatchOptions o;
  o.step_s = 3e-4;  // the driver holds for 1 ms
  EXPECT_THROW(Batch<float>(1, test::nominal(), o), std::invalid_argument);
  o.step_s = 0;
  EXPECT_THROW(Batch<float>(1, test::nominal(), o), std::invalid_argument);
  o = {};
  o.instruction_set = "z80";
  EXPECT_THROW(Batch<float>(1, test::nominal(), o), std::invalid_argument);
  Batch<float> b(3, test::nominal());
  EXPECT_THROW(b.state(3), std::out_of_range);
  EXPECT_THROW(b.reset(3, {}), std::out_of_range);
}

TEST(Batch, ReturnsTheStateItWasGiven) {
  Batch<double> b(1, test::identified(), one_thread());
  FlapperState s;
  s.position_m[1] = 0.3;
  s.attitude[0] = 0.8, s.attitude[2] = 0.6;
  s.velocity_m_s[0] = 1.5;
  s.body_rate_rad_s[2] = -4;
  s.stroke_rad[0] = 0.4, s.stroke_rad[1] = -0.2;
  s.rotation_rate_rad_s[1] = 90;
  s.stroke_rate_rad_s[0] = 150;
  b.reset(0, s);
  const FlapperState r = b.state(0);
  for (int i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(r.position_m[i], s.position_m[i]);
    EXPECT_NEAR(r.velocity_m_s[i], s.velocity_m_s[i], 1e-15);
    EXPECT_DOUBLE_EQ(r.body_rate_rad_s[i], s.body_rate_rad_s[i]);
  }
  EXPECT_DOUBLE_EQ(r.stroke_rad[0], 0.4);
  EXPECT_DOUBLE_EQ(r.stroke_rate_rad_s[0], 150);
  EXPECT_DOUBLE_EQ(r.rotation_rate_rad_s[1], 90);
}

TEST(Support, HoldsAStandingVehicleThatCannotLift) {
  Batch<float> b(1, test::nominal(), one_thread(ground_at(0)));
  b.reset(0, {}, Start::standing);
  b.set_input(0, {8, 1, 1, 0.1});  // 70 % of the weight
  b.step(10000);
  EXPECT_EQ(b.support(0), Start::standing);
  const FlapperState s = b.state(0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(s.position_m[i], 0);
  EXPECT_EQ(s.attitude[0], 1);
  EXPECT_NE(s.stroke_rad[0], 0);
  EXPECT_EQ(b.status(0), 0u);
}

TEST(Support, LetsGoOfAVehicleThatLifts) {
  Batch<float> b(1, test::nominal(), one_thread(ground_at(0)));
  b.reset(0, {}, Start::standing);
  b.set_input(0, {14, 0, 0, 0});  // 1.7 times the weight
  b.step(2000);
  EXPECT_EQ(b.support(0), Start::flying);
  EXPECT_GT(b.state(0).position_m[2], 0.005);
  EXPECT_EQ(b.status(0), 0u) << "leaving the ground is no contact";
}

// What carried it off for a moment does not do so again at once: it stands until its wings carry it anew.
TEST(Support, StartsOverAfterAFallBack) {
  Batch<double> b(1, test::nominal(), one_thread(ground_at(0)));
  b.reset(0, {}, Start::standing);
  b.set_input(0, {14, 0, 0, 0});  // 1.7 times the weight
  const auto steps_until = [&](Start support, int most) {
    int steps = 0;
    while (b.support(0) != support && steps < most) b.step(1), ++steps;
    return steps;
  };
  const int first = steps_until(Start::flying, 2000);
  ASSERT_LT(first, 2000);
  b.set_input(0, {0, 0, 0, 0});
  ASSERT_LT(steps_until(Start::standing, 2000), 2000);
  EXPECT_LT(b.state(0).position_m[2], 1e-9);
  b.step(400);  // without voltage it stays
  EXPECT_EQ(b.support(0), Start::standing);
  b.set_input(0, {14, 0, 0, 0});
  EXPECT_GT(steps_until(Start::flying, 2000), first / 2);
}

TEST(Support, WeldedNeverMoves) {
  Batch<double> b(1, test::nominal(), one_thread());
  b.reset(0, {}, Start::welded);
  b.set_input(0, {18, 0, 0, 0});
  b.step(5000);
  EXPECT_EQ(b.support(0), Start::welded);
  EXPECT_EQ(b.state(0).position_m[2], 0);
  EXPECT_GT(b.held_impulse(0).force_N_s[2], 0);
}

TEST(Contact, IsAnEventForEachSurface) {
  World w = ground_at(-0.05);
  w.ceiling_z_m = 0.3;
  w.walls = {{0.2, 0, -1, 0}};
  Batch<float> b(4, test::nominal(), one_thread(w));
  FlapperState up, forward;
  up.velocity_m_s[2] = 5;
  forward.velocity_m_s[0] = 5;
  b.reset(1, up);
  b.reset(2, forward);
  FlapperState slow;
  b.reset(3, slow);
  b.step(700);
  EXPECT_EQ(b.status(1), kTouchedCeiling);
  EXPECT_EQ(b.status(2), kTouchedWall);
  EXPECT_EQ(b.status(3), 0u);
  b.step(1000);
  EXPECT_TRUE(b.status(0) & kTouchedGround);
  b.reset(0, {});
  EXPECT_EQ(b.status(0), 0u);
  EXPECT_EQ(b.count_status(kTouchedCeiling), 1u);
}

TEST(Freeze, StopsOneAndLeavesItsNeighbours) {
  const auto run = [](bool disturbed) {
    Batch<float> b(16, test::nominal(), one_thread());
    for (std::size_t i = 0; i < 16; ++i) b.set_input(i, {9 + 0.1 * static_cast<double>(i), 0, 0, 0});
    if (disturbed) {
      FlapperState s;
      s.velocity_m_s[0] = NAN;
      b.reset(5, s);
      s.velocity_m_s[0] = 0;
      s.body_rate_rad_s[1] = 1e7;
      b.reset(6, s);
    }
    for (int i = 0; i < 50; ++i) b.step(20);
    return b;
  };
  const Batch<float> calm = run(false), disturbed = run(true);
  EXPECT_EQ(disturbed.status(5), kFrozen);
  EXPECT_EQ(disturbed.status(6), kFrozen);
  EXPECT_EQ(disturbed.count_status(kFrozen), 2u);
  EXPECT_EQ(calm.count_status(kFrozen), 0u);
  for (std::size_t i = 0; i < 16; ++i)
    if (i != 5 && i != 6) EXPECT_EQ(calm.hash(i, i + 1), disturbed.hash(i, i + 1)) << i;
}

TEST(Freeze, KeepsTheLastPlausibleState) {
  Batch<double> b(1, test::nominal(), one_thread());
  FlapperState s;
  s.position_m[0] = 0.25;
  s.body_rate_rad_s[0] = 1500;
  b.reset(0, s);
  b.step(20);
  b.step(20);
  EXPECT_EQ(b.status(0), kFrozen);
  EXPECT_EQ(b.state(0).position_m[0], 0.25);
}

TEST(Batch, StepsByNothingLeaveItAsItIs) {
  Batch<float> b(40, test::nominal(), one_thread());
  b.step(20);
  const auto before = b.hash(0, 40);
  b.step(0);
  EXPECT_EQ(b.hash(0, 40), before);
  EXPECT_THROW(b.step(-1), std::invalid_argument);
}

TEST(WingBeat, FollowsItsInputsAndLimits) {
  // an input beyond its limit is the limit
  Batch<double> b(2, test::nominal(), one_thread());
  for (const std::size_t i : {0UL, 1UL}) b.reset(i, {}, Start::welded);
  b.set_input(0, {25, 9, -9, 0.4});
  b.set_input(1, {18, 3, -3.5, 0.15});
  b.step(3000);
  EXPECT_EQ(b.status(0) | b.status(1), 0u);
  EXPECT_NE(b.state(0).stroke_rad[1], 0);
  EXPECT_EQ(b.state(0).stroke_rad[1], b.state(1).stroke_rad[1]);
}

// ---- voltages that are set directly

/// What the wing beat gives both motors at its `update`th update after a reset, one flapper at a time.
template <class T>
std::pair<double, double> beat_voltages(const model::Vehicle& v, const Input& u, std::uint32_t update) {
  using L = model::Lanes<T, 1>;
  const auto per_update = static_cast<std::uint32_t>(std::llround(v.driver.flapping_Hz * v.driver.hold_s * 0x1p32));
  const L fraction(static_cast<double>(model::beat_fraction<T>(update * per_update)));
  const model::WingBeat<L> beat{L(u.amplitude_V), L(u.difference_V), L(u.bias_V), L(u.split_cycle)};
  return {model::wing_beat_voltage<+1>(beat, fraction, L(v.left.motor.voltage_limit_V)).raw[0],
          model::wing_beat_voltage<-1>(beat, fraction, L(v.right.motor.voltage_limit_V)).raw[0]};
}

/// Under effects that act on the drive, one with a memory: whoever sets the beat's voltages flies as the beat does, to the bit,
/// and so he does once the driver has its inputs again.
template <class T>
void fly_as_the_beat(const std::string& instruction_set) {
  model::Vehicle v = test::identified();
  v.effects["battery_sag"] = {{"source_ohm", 1.0}, {"fade_V_C", 0.05}, {"nominal_V", 18}};
  v.effects["command_delay"] = {{"delay_s", 0.0005}};
  BatchOptions o;
  o.threads = 1;
  o.instruction_set = instruction_set;
  o.meters_energy = true;
  Batch<T> b(5, v, o);
  const Input u{11, 0.5, -0.4, 0.03};
  for (std::size_t i = 0; i < 5; ++i) b.reset(i, {});
  for (const std::size_t i : {0UL, 1UL, 3UL}) b.set_input(i, u);
  const auto same = [&](std::size_t a, std::size_t other) {
    const FlapperState x = b.state(a), y = b.state(other);
    EXPECT_EQ(std::memcmp(&x, &y, sizeof x), 0) << instruction_set;
    EXPECT_EQ(b.energy_J(a), b.energy_J(other)) << instruction_set;
  };
  for (std::uint32_t update = 0; update < 150; ++update) {
    if (update < 90) {
      const auto [left_V, right_V] = beat_voltages<T>(v, u, update);
      EXPECT_LT(std::abs(left_V), 18);
      b.set_voltages(3, left_V, right_V);
    } else if (update == 90) {
      EXPECT_NE(b.hash(3, 4), b.hash(0, 1)) << "who holds its voltages has another future";
      b.set_input(3, u);
    }
    b.step(4);
    if (update % 30 == 29) same(3, 0);
  }
  EXPECT_EQ(b.hash(3, 4), b.hash(0, 1)) << instruction_set;
  EXPECT_EQ(b.hash(1, 2), b.hash(0, 1)) << instruction_set << ": beside one that is set, and beside none";
  EXPECT_NE(b.state(0).position_m[2], b.state(4).position_m[2]);
}

TEST(Voltages, OfTheBeatFlyAsTheBeat) {
  for (const std::string& set : instruction_sets()) {
    fly_as_the_beat<float>(set);
    fly_as_the_beat<double>(set);
  }
}

TEST(Voltages, AreClippedAndHeldUntilTheyAreSetAgain) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();
  model::Vehicle weak = test::nominal();
  weak.left.motor.voltage_limit_V = 6;
  Batch<double> b(6, test::nominal(), one_thread());
  for (std::size_t i = 0; i < 6; ++i) b.reset(i, {}, Start::welded);
  const auto same = [&](std::size_t a, std::size_t other) { EXPECT_EQ(b.hash(a, a + 1), b.hash(other, other + 1)); };
  b.set_voltages(0, 18, -18);
  b.set_voltages(1, 30, kNaN);  // as of an input, the least of what is no number
  b.set_voltages(2, kInfinite, -kInfinite);
  b.set_voltages(3, 6, -18);
  b.set_voltages(4, 17, -18);
  b.set_vehicle(4, weak);
  b.set_voltages(5, 6.5, -18);
  for (int period = 0; period < 7; ++period) b.step(5);  // not in step with the driver's hold of 10
  same(1, 0);
  same(2, 0);
  EXPECT_NE(b.hash(3, 4), b.hash(0, 1));
  EXPECT_NE(b.hash(5, 6), b.hash(3, 4));
  EXPECT_EQ(b.state(4).stroke_rad[0], b.state(3).stroke_rad[0]) << "a motor that takes less gets less, from the start";
  EXPECT_GT(b.state(0).stroke_rad[0], 0.01);
  EXPECT_LT(b.state(0).stroke_rad[1], -0.01);
  // at once, and within the limits, while the driver holds
  const double before_rad_s = b.state(0).stroke_rate_rad_s[0];
  b.set_voltages(0, -18, 18);
  b.set_voltages(1, -19, 25);
  b.set_voltages(2, kNaN, kInfinite);
  b.step(3);
  same(1, 0);
  same(2, 0);
  EXPECT_LT(b.state(0).stroke_rate_rad_s[0], before_rad_s);
  EXPECT_EQ(b.status(0), 0u);
  EXPECT_THROW(b.set_voltages(6, 0, 0), std::out_of_range);

  Batch<double> fresh(1, test::nominal(), one_thread());
  fresh.reset(0, {});
  b.reset(0, {});
  EXPECT_EQ(b.hash(0, 1), fresh.hash(0, 1)) << "a reset gives the motors back";
}

// ---- effects

model::Vehicle with(const std::string& id, std::map<std::string, double> parameters) {
  model::Vehicle v = test::nominal();
  v.effects[id] = std::move(parameters);
  return v;
}

double height_after(const model::Vehicle& v, double seconds, double start_z) {
  Batch<double> b(1, v, one_thread(ground_at(0)));
  FlapperState s;
  s.position_m[2] = start_z;
  b.reset(0, s);
  b.set_input(0, {10, 0, 0, 0});
  b.step(static_cast<int>(seconds / kStep));
  return b.state(0).position_m[2];
}

TEST(Effects, OfOneFlapperLeaveItsBlockAlone) {
  Batch<float> plain(8, test::nominal(), one_thread()), mixed(8, test::nominal(), one_thread());
  mixed.set_vehicle(3, with("body_drag", {{"drag_area_m2", 0.002}}));
  for (std::size_t i = 0; i < 8; ++i) {
    plain.set_input(i, {10, 0.5, 0, 0});
    mixed.set_input(i, {10, 0.5, 0, 0});
  }
  plain.step(3000);
  mixed.step(3000);
  for (std::size_t i = 0; i < 8; ++i) {
    if (i == 3) EXPECT_NE(plain.hash(i, i + 1), mixed.hash(i, i + 1));
    else EXPECT_EQ(plain.hash(i, i + 1), mixed.hash(i, i + 1)) << i;
  }
}

TEST(Effects, GroundEffectLiftsNearTheGroundOnly) {
  const model::Vehicle v = with("ground_effect", {{"gain", 0.2}, {"length_m", 0.05}});
  EXPECT_GT(height_after(v, 0.2, 0.05), height_after(test::nominal(), 0.2, 0.05) + 1e-4);
  EXPECT_NEAR(height_after(v, 0.2, 2), height_after(test::nominal(), 0.2, 2), 1e-12);  // exp(-40)
}

TEST(Effects, BodyDragBrakesAsAnIsolatedBodyWould) {
  // no air on the wings (density acts on drag alone through the parameter), no gravity: dv/dt = -rho A v^2 /
  // 2m
  model::Vehicle v = with("body_drag", {{"drag_area_m2", 0.002}, {"centre_z_m", 0}});
  for (model::Side* s : {&v.left, &v.right}) s->planform.mean_chord_m = 1e-5;
  double mass = v.torso.mass_kg;
  for (const model::Side* s : {&v.left, &v.right}) mass += s->leading_edge.mass_kg + s->wing.mass_kg;
  World w;
  w.gravity_m_s2 = 0;
  Batch<double> b(1, v, one_thread(w));
  FlapperState s;
  s.velocity_m_s[0] = 2;
  b.reset(0, s);
  const double seconds = 0.1, k = v.air_density_kg_m3 * 0.002 / (2 * mass);
  b.step(static_cast<int>(seconds / kStep));
  // the torso turns a little under drag off the centre of mass; first order in the step: k v h / 2 = 1e-5
  EXPECT_NEAR(b.state(0).velocity_m_s[0], 2 / (1 + k * 2 * seconds), 2e-3);
  EXPECT_LT(b.state(0).velocity_m_s[0], 2 - 0.03);
}

}  // namespace
}  // namespace flappy::sim::batch_test
