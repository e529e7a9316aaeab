// Every effect of the registry in flight: exactly off at size 0, at work at its typical size, alike in every place.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "model/effects/registry.hpp"
#include "sim/replay.hpp"
#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::sim {
namespace {

using model::CatalogueEffect;
using model::EffectParameter;
using model::effects;

/// All sizes of an effect at `scale` times their typical values, its shapes typical.
model::Vehicle with(const CatalogueEffect& e, double scale) {
  model::Vehicle v = test::identified();
  for (std::size_t k = 0; k < e.parameters.size(); ++k) {
    const EffectParameter& p = e.parameters[k];
    v.effects[e.info.id][p.name] = static_cast<int>(k) < e.info.magnitudes ? scale * p.typical : p.typical;
  }
  return v;
}

/// Near the ground, a ceiling and a wall, and drifting.
BatchOptions room() {
  BatchOptions o;
  o.step_s = 1e-4;
  o.threads = 1;
  o.meters_energy = true;
  o.world.ground_z_m = 0;
  o.world.ceiling_z_m = 0.35;
  o.world.walls = {{0.5, 0, -1, 0}, {0, -0.2, 0, 1}};
  return o;
}

FlapperState start() {
  FlapperState s;
  s.position_m[2] = 0.15;
  s.velocity_m_s[0] = 0.2;
  s.body_rate_rad_s[1] = 0.5;
  return s;
}

constexpr Input kHard{17.5, 0.4, -0.3, 0.02};  // strokes beyond 80 degrees

template <class T>
void begin(Batch<T>& b) {
  for (std::size_t i = 0; i < b.size(); ++i) {
    b.reset(i, start());
    b.set_input(i, kHard);
  }
}

/// Largest change of a flight of `steps` steps by an effect, over place and wings (m, rad).
double change(const model::Vehicle& v, int steps) {
  Batch<double> b(2, test::identified(), room());
  b.set_vehicle(1, v);
  begin(b);
  double most = 0;
  for (int i = 0; i < steps; i += 10) {
    b.step(10);
    const FlapperState p = b.state(0), q = b.state(1);
    for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(p.position_m[k] - q.position_m[k]));
    for (int k = 0; k < 4; ++k) most = std::max(most, std::abs(p.attitude[k] - q.attitude[k]));
    for (int k = 0; k < 2; ++k) most = std::max(most, std::abs(p.stroke_rad[k] - q.stroke_rad[k]));
  }
  return most;
}

TEST(Effects, AreTheCatalogue) {
  std::set<std::string_view> ids, groups;
  for (const CatalogueEffect& e : effects()) {
    EXPECT_TRUE(ids.insert(e.info.id).second) << e.info.id;
    EXPECT_EQ(model::effect_index(e.info.id), static_cast<int>(ids.size()) - 1);
    if (*e.info.group) groups.insert(e.info.group);
  }
  EXPECT_EQ(ids.size(), 30u);
  EXPECT_EQ(groups, (std::set<std::string_view>{"wing_inertia", "unsteady_lift", "low_voltage", "asymmetry",
                                                "thrust_loss", "world_force", "drive_lag", "wing_compliance"}));
}

TEST(Effects, StateTheirParameters) {
  const std::set<std::string_view> units = {"m", "m2", "s", "V", "ohm", "rad"},
                                   ratios = {"gain", "factor", "decay", "left_area", "right_area", "extra",
                                             "xy",   "xz",     "yz",    "product",   "side_gain",  "damping_ratio"};
  const std::set<std::string_view> compound = {
      "roll_gain_m",       "twist_rad_N", "x_m_s",          "y_m_s",    "z_m_s",
      "gust_m_s",          "per_rad2",    "stribeck_rad_s", "rise_K_W", "fade_V_C",
      "compliance_rad_Nm", "line_kg_m",   "stiffness_N_m"};
  for (const CatalogueEffect& e : effects()) {
    EXPECT_GE(e.info.magnitudes, 1) << e.info.id;
    EXPECT_LE(e.info.magnitudes, static_cast<int>(e.parameters.size())) << e.info.id;
    EXPECT_TRUE(e.acts(e.values({}))) << e.info.id;
    for (std::size_t k = 0; k < e.parameters.size(); ++k) {
      const EffectParameter& p = e.parameters[k];
      const std::string_view name = p.name;
      EXPECT_TRUE(ratios.contains(name) || compound.contains(name) || units.contains(name.substr(name.rfind('_') + 1)))
          << e.info.id << "." << name;
      EXPECT_LE(p.low, p.prior_low) << e.info.id << "." << name;
      EXPECT_LE(p.prior_low, p.typical) << e.info.id << "." << name;
      EXPECT_LE(p.typical, p.prior_high) << e.info.id << "." << name;
      EXPECT_LE(p.prior_high, p.high) << e.info.id << "." << name;
      if (static_cast<int>(k) >= e.info.magnitudes)  // a shape: the middle
        EXPECT_NEAR(p.typical, (p.prior_low + p.prior_high) / 2, 1e-12) << e.info.id << "." << name;
      else if (p.low < 0) EXPECT_EQ(p.prior_low, -p.prior_high) << e.info.id << "." << name;
      else EXPECT_EQ(p.prior_low, 0) << e.info.id << "." << name;
    }
  }
}

TEST(Effects, HaveTheirEquationsDocumented) {
  std::ifstream file(test::source_path("docs/reference/effects.md"));
  bool generated = false;  // the tables of parameters, which scripts/reference writes
  std::set<std::string> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("<!--")) generated = line.starts_with("<!-- generated");
    if (!generated && line.starts_with("| ")) rows.insert(line.substr(2, line.find(' ', 2) - 2));
  }
  model::Vehicle beat_averaged;
  beat_averaged.beat_averaged.emplace();
  for (const auto* catalogue : {&effects(), &model::catalogue_of(beat_averaged)})
    for (const CatalogueEffect& e : *catalogue) EXPECT_TRUE(rows.contains(e.info.id)) << e.info.id;
}

TEST(Effects, VanishExactlyAtMagnitudeZero) {
  // alone, beside a lane that has the effect, and beside one that has all of them
  constexpr int kSteps = 10000;
  Batch<float> plain(1, test::identified(), room());
  begin(plain);
  plain.step(kSteps);
  ASSERT_EQ(plain.status(0) & kFrozen, 0u);
  model::Vehicle all = test::identified(), none = test::identified();
  for (const CatalogueEffect& e : effects()) {
    all.effects[e.info.id] = {};
    none.effects[e.info.id] = with(e, 0).effects[e.info.id];
    Batch<float> alone(1, with(e, 0), room());
    Batch<float> beside(3, with(e, 0), room());
    beside.set_vehicle(1, with(e, 1));
    beside.set_vehicle(2, test::identified());
    begin(alone);
    begin(beside);
    alone.step(kSteps);
    beside.step(kSteps);
    EXPECT_EQ(alone.hash(), plain.hash()) << e.info.id;
    EXPECT_EQ(beside.hash(0, 1), plain.hash()) << e.info.id;
    EXPECT_EQ(beside.hash(2, 3), plain.hash()) << e.info.id;
    // a sensor's effect changes what is seen of a flight, not the flight
    EXPECT_EQ(beside.hash(1, 2) == plain.hash(), e.info.stage == model::Stage::sensor) << e.info.id;
  }
  Batch<float> full(4, all, room());
  full.set_vehicle(1, none);
  full.set_vehicle(3, test::identified());
  begin(full);
  full.step(kSteps);
  EXPECT_EQ(full.hash(1, 2), plain.hash());
  EXPECT_EQ(full.hash(3, 4), plain.hash());
  EXPECT_EQ(full.hash(0, 1), full.hash(2, 3));
}

TEST(Effects, DoMoreAtALargerMagnitude) {
  // One beat, in which most effects are linear in their sizes: 2. Thresholds (stops, play, contact of the wings) make some
  // grow faster, time (delay) slower. The least is 1.46, of the play: a motor reaches the end of a gap of twice the size
  // after sqrt(2) times the time.
  for (const CatalogueEffect& e : effects()) {
    if (e.info.stage == model::Stage::sensor) continue;
    const double half = change(with(e, 0.5), 300), typical = change(with(e, 1), 300);
    EXPECT_GT(typical, 1e-6) << e.info.id;
    EXPECT_GT(typical, 1.4 * half) << e.info.id << ": " << half << ", " << typical;
  }
}

TEST(Effects, KeepTheirMemoryFromCallToCallAndForgetItAtAReset) {
  model::Vehicle all = test::identified();
  for (const CatalogueEffect& e : effects()) all.effects[e.info.id] = {};
  Batch<float> once(2, all, room()), often(2, all, room()), again(2, all, room());
  begin(once);
  begin(often);
  once.step(2000);
  for (int i = 0; i < 2000; i += 500) often.step(500);
  // calls round where the torso is: what the effects remember of voltages is the same to the bit, of motion nearly
  EXPECT_NEAR(once.state(0).position_m[2], often.state(0).position_m[2], 1e-3);
  begin(again);
  again.step(777);
  begin(again);
  storage_of(again).steps = 0;
  again.step(2000);
  EXPECT_EQ(once.hash(), again.hash());
}

TEST(Effects, OfAFrozenFlapperForgetWithIt) {
  model::Vehicle all = test::identified();
  for (const CatalogueEffect& e : effects()) all.effects[e.info.id] = {};
  Batch<float> b(1, all, room());
  FlapperState s = start();
  s.velocity_m_s[0] = 1e6;
  b.reset(0, s);
  b.set_input(0, kHard);
  b.step(20);
  EXPECT_EQ(b.status(0) & kFrozen, static_cast<std::uint32_t>(kFrozen));
  storage_of(b).for_states(0, ~std::uint64_t{0}, [](float number) { EXPECT_EQ(number, 0); });
}

TEST(Effects, AreNotToBeMadeUp) {
  model::Vehicle v = test::identified();
  v.effects["wing_flutter"] = {};
  EXPECT_THROW(Batch<float>(1, v, room()), std::invalid_argument);
  v.effects = {{"command_delay", {{"delay_s", 0.02}}}};
  BatchOptions fine = room();
  fine.step_s = 5e-5;  // 400 steps, of which 254 are kept
  EXPECT_THROW(Batch<float>(1, v, fine), std::invalid_argument);
}

TEST(Effects, RememberThroughAReplaysSpinUp) {
  // a delay of 5 ms is longer than the millisecond after which a replay puts the torso back: with a memory that each
  // putting back cleared, no voltage would ever arrive
  model::Vehicle late = test::identified();
  late.effects["command_delay"] = {{"delay_s", 0.005}};
  Batch<double> b(1, late, room());
  b.reset(0, start());
  b.set_input(0, {10, 0, 0, 0});
  VoltageScript voltages;
  std::vector<FlapperState> flown;
  for (int i = 0; i < 2000; ++i) {
    flown.push_back(b.state(0));
    b.step(1);
    const auto [block, lane] = storage_of(b).at(0);
    const auto drive = get<Drive<double>>(block.drive, lane);
    voltages.t_s.push_back(i * 1e-4);
    voltages.left_V.push_back(drive.voltages.left_V);
    voltages.right_V.push_back(drive.voltages.right_V);
  }
  ReplayOptions o;
  o.step_s = 1e-4;
  o.threads = 1;
  o.spin_up_steps = 1200;
  const auto recorded = [&](std::size_t, double t_s) {
    return flown[static_cast<std::size_t>(std::lround(t_s * 1e4))];
  };
  const auto result = replay({{0.15, &late, &voltages}}, {100}, recorded, o);
  // strokes reach 1 rad; the wings have four beats to come into phase
  EXPECT_NEAR(result[0].states[0].stroke_rad[0], flown[1600].stroke_rad[0], 0.05);
  EXPECT_GT(std::abs(flown[1600].stroke_rad[0] - flown[1550].stroke_rad[0]), 0.3);
}

/// What one flapper draws: metered; summed as V (V - K N psi')/R h over its steps, with the driver's voltages as `motor_V` changes them;
/// and by how much the trapezium's rule may differ from that sum, half the step times the current's changes.
struct Drawn {
  double metered_J, summed_J = 0, half_changes_J = 0;
};
template <class MotorVoltage>
Drawn drawn(const model::Vehicle& v, double step_s, const MotorVoltage& motor_V) {
  BatchOptions o = room();
  o.step_s = step_s;
  Batch<double> b(1, v, o);
  begin(b);
  Drawn d{};
  std::vector<double> driver_V[2];
  for (int i = 0; i < std::lround(0.3 / step_s); ++i) {
    const FlapperState before = b.state(0);
    b.step(1);
    const FlapperState after = b.state(0);
    const auto [block, lane] = storage_of(b).at(0);
    const Voltages<double> given = get<Drive<double>>(block.drive, lane).voltages;
    for (const std::size_t side : {0, 1}) {
      driver_V[side].push_back(side == 0 ? given.left_V : given.right_V);
      const model::Motor& m = side == 0 ? v.left.motor : v.right.motor;
      const double volt = motor_V(driver_V[side]), emf_V_s = m.torque_constant_Nm_A * m.gear_ratio;
      d.summed_J += step_s * volt * (volt - emf_V_s * after.stroke_rate_rad_s[side]) / m.resistance_ohm;
      d.half_changes_J += step_s / 2 * std::abs(volt) * emf_V_s / m.resistance_ohm *
                          std::abs(after.stroke_rate_rad_s[side] - before.stroke_rate_rad_s[side]);
    }
  }
  d.metered_J = b.energy_J(0);
  b.reset(0, start());
  EXPECT_EQ(b.energy_J(0), 0);
  return d;
}
const auto kAsDriven = [](const std::vector<double>& driver_V) { return driver_V.back(); };

// The meter knows strokes, the sum rates: they agree to rounding. A tenth of the step, summed by rates half-way, agrees to what
// either may be off by, and a step's own error of the flight, of first order, is below a percent.
TEST(Energy, IsTheWorkOfTheMotors) {
  const model::Vehicle v = test::identified();
  const Drawn d = drawn(v, 1e-4, kAsDriven), fine = drawn(v, 1e-5, kAsDriven);
  EXPECT_GT(d.metered_J, 0.5);
  EXPECT_NEAR(d.metered_J / d.summed_J, 1, 1e-11);
  EXPECT_LT(fine.half_changes_J, 0.005 * fine.summed_J);
  EXPECT_NEAR(d.metered_J, fine.metered_J, 1.1 * d.half_changes_J);
  EXPECT_LT(d.half_changes_J, 0.04 * d.summed_J);
  // in one go, and in single precision, whose sums of some 1e3 shares of 1e-7 err at random
  Batch<double> once(1, v, room());
  Batch<float> single(1, v, room());
  begin(once), begin(single);
  once.step(3000), single.step(3000);
  EXPECT_NEAR(once.energy_J(0) / d.metered_J, 1, 1e-11);
  EXPECT_NEAR(single.energy_J(0) / d.metered_J, 1, 1e-4);
}

// By the voltage that reaches the motors, the driver's of 90 steps ago less 0.4 V on either side of 0; the driver's own would be far off.
TEST(Energy, IsOfWhatReachesTheMotors) {
  model::Vehicle v = test::identified();
  const auto late = [](const std::vector<double>& u) { return u.size() > 90 ? u[u.size() - 91] : 0; };
  const auto dead = [](double u) { return std::copysign(std::max(std::abs(u) - 0.4, 0.0), u); };
  v.effects = {{"command_delay", {{"delay_s", 0.009}}}};
  const Drawn delayed = drawn(v, 1e-4, late);
  EXPECT_NEAR(delayed.metered_J / delayed.summed_J, 1, 1e-11);
  EXPECT_GT(std::abs(drawn(v, 1e-4, kAsDriven).summed_J / delayed.summed_J - 1), 0.3);
  v.effects["driver_dead_zone"] = {{"dead_V", 0.4}};
  const Drawn both = drawn(v, 1e-4, [&](const std::vector<double>& u) { return dead(late(u)); });
  EXPECT_NEAR(both.metered_J / both.summed_J, 1, 1e-11);
  // hot windings resist, to 12 % from a typical flight's 30 K on: less is drawn at the same voltage
  v.effects = {{"winding_heating", {{"rise_K_W", 300}, {"time_s", 0.1}}}};
  const Drawn hot = drawn(v, 1e-4, kAsDriven);
  EXPECT_LT(hot.metered_J, 0.95 * hot.summed_J);
}

TEST(Energy, IsMeteredWhereAskedFor) {
  Batch<float> with(1, test::identified(), room()), without(1, test::identified(), {});
  EXPECT_THROW(without.energy_J(0), std::logic_error);
  BatchOptions o = room();
  o.meters_energy = false;
  Batch<float> plain(1, test::identified(), o);
  begin(with), begin(plain);
  with.step(1000), plain.step(1000);
  EXPECT_EQ(with.hash(), plain.hash());
}

// Effects change what their own flappers draw: that of others stays, to the bit.
TEST(Energy, OfOthersIsLeftAlone) {
  model::Vehicle all = test::identified();
  for (const CatalogueEffect& e : effects()) all.effects[e.info.id] = {};
  Batch<float> alone(3, test::identified(), room()), beside(3, test::identified(), room());
  beside.set_vehicle(1, all);
  begin(alone), begin(beside);
  alone.step(1000), beside.step(1000);
  for (const std::size_t i : {0, 1, 2})
    EXPECT_EQ(alone.energy_J(i) == beside.energy_J(i), i != 1)
        << i << ' ' << std::hexfloat << alone.energy_J(i) << ' ' << beside.energy_J(i);
}

}  // namespace
}  // namespace flappy::sim
