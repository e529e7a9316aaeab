// What a workshop can build: the published robot to the digit, changes by their laws, and refusals.
#include "design/robot.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fixture.hpp"
#include "flappy/vehicle_file.hpp"
#include "refusal.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::design {
namespace {

const Space& space() {
  static const Space made = small_config().judge.space;
  return made;
}

Robot with(const std::vector<std::pair<Quantity, double>>& changes) {
  Values values = space().built;
  for (const auto& [quantity, value] : changes) value_of(values, quantity) = value;
  return build(space(), values);
}

TEST(Robot, WithoutChangesIsThePublishedOne) {
  const Robot r = with({});
  EXPECT_EQ(r.refused, "");
  EXPECT_EQ(model::vehicle_text(r.vehicle), model::vehicle_text(test::nominal()));
}

TEST(Robot, AMotorMovesItsMass) {
  const auto& motors = space().workshop.motors;
  std::size_t other = space().workshop.built_motor == 0 ? 1 : 0;
  const MotorType &was = motors[space().workshop.built_motor], &now = motors[other];
  const Robot r = with({{Quantity::motor, static_cast<double>(other)}});
  const WholeBody before = whole_body(test::nominal()), after = whole_body(r.vehicle);
  const double more_kg = now.mass_kg - was.mass_kg;
  EXPECT_NEAR(after.mass_kg - before.mass_kg, 2 * more_kg, 1e-12);
  const double y = test::nominal().left.shoulder_m.y + space().workshop.motor_m.y;
  // two points at +-y: the sum of m y^2, as the centre of mass is in the plane of symmetry to 1 um
  const double yy = [](const model::InertiaTensor& a, const model::InertiaTensor& b) {
    return (b.xx + b.zz - b.yy - (a.xx + a.zz - a.yy)) / 2;
  }(before.inertia_kg_m2, after.inertia_kg_m2);
  EXPECT_NEAR(yy, 2 * more_kg * y * y, 1e-12 + 1e-3 * std::abs(2 * more_kg * y * y));
  EXPECT_EQ(r.vehicle.left.motor.resistance_ohm, now.resistance_ohm);
  EXPECT_EQ(r.vehicle.right.motor.torque_constant_Nm_A, now.torque_constant_Nm_A);
}

TEST(Robot, ABatteryWeighsAndLimitsTheVoltage) {
  const Robot r = with({{Quantity::cells, 2}, {Quantity::battery, 2e-3}});
  EXPECT_EQ(r.refused, "");
  EXPECT_NEAR(whole_body(r.vehicle).mass_kg - whole_body(test::nominal()).mass_kg, 2e-3, 1e-12);
  EXPECT_DOUBLE_EQ(r.vehicle.driver.amplitude_limit_V, 2 * space().workshop.cell_V);
  EXPECT_DOUBLE_EQ(r.vehicle.left.motor.voltage_limit_V, 2 * space().workshop.cell_V);
  EXPECT_DOUBLE_EQ(r.battery_J, 2e-3 * space().workshop.battery_J_kg);
}

TEST(Robot, ALongerWingGetsAStifferRod) {
  const double length = 1.1 * space().built[0];
  const Robot r = with({{Quantity::wing_length, length}});
  EXPECT_EQ(r.refused, "");
  EXPECT_GE(r.rod_m, stiff_diameter_m(length, space().built[0], space().workshop.built_rod_m) * (1 - 1e-9));
  EXPECT_GT(r.vehicle.left.leading_edge.mass_kg, test::nominal().left.leading_edge.mass_kg);
  EXPECT_NEAR(r.vehicle.extent.around_m - test::nominal().extent.around_m, length - space().built[0], 1e-12);
  EXPECT_NEAR(r.vehicle.left.wing.com_m.y, -r.vehicle.right.wing.com_m.y, 1e-9);
}

TEST(Robot, AGearMovesTheInertiaOfItsWheel) {
  const double J = space().workshop.built_wheel_kg_m2;
  const Robot r = with({{Quantity::gear_ratio, 11}});
  EXPECT_EQ(r.refused, "");
  const auto stroke = [](const model::Vehicle& v) {
    const model::Sym3<double> P = mass_of(v.left.leading_edge).second_kg_m2;
    return P.xx + P.yy;
  };
  EXPECT_NEAR(stroke(r.vehicle) - stroke(test::nominal()), J * (1.1 * 1.1 * 1.1 - 1), 1e-15);
}

TEST(Robot, WhatCannotBeIsRefusedWithAReason) {
  const auto refused = [](const std::vector<std::pair<Quantity, double>>& changes, const std::string& why) {
    EXPECT_NE(with(changes).refused.find(why), std::string::npos) << with(changes).refused;
  };
  refused({{Quantity::tip_chord, 0.1}}, "narrow");
  refused({{Quantity::wing_length, 0.19}}, "no rod in stock");
  refused({{Quantity::cells, 2}}, "battery without mass");
  refused({{Quantity::battery, 1e-3}}, "battery without cells");
  refused({{Quantity::shoulder_y, 0.009}}, "apart");
  // 2 (1.2 N + 0.2) + 0.4 mm of teeth between shoulders that are 27.9 mm apart
  refused({{Quantity::gear_ratio, 11.3}}, "do not fit beside each other");
  EXPECT_EQ(with({{Quantity::gear_ratio, 11.25}}).refused, "");
}

TEST(Space, RoundsToTheStepsOfTheWorkshop) {
  const Space& s = space();
  for (const double at : {0.0, 0.123, 0.77, 1.0}) {
    const Values values = s.values(std::vector<double>(s.variables.size(), at));
    for (const Variable& v : s.variables) {
      if (!v.choices.empty()) continue;
      const double value = value_of(values, v.quantity), steps = (value - v.low) / v.step;
      EXPECT_GE(value, v.low - 1e-12);
      EXPECT_LE(value, v.high + 1e-12);
      if (v.step > 0) EXPECT_NEAR(steps, std::round(steps), 1e-6) << info_of(v.quantity).name;
    }
    EXPECT_EQ(s.values(s.unit(values)), values);
  }
}

// A search goes on from what a diagnosis corrected: its effects stay, its posterior is of parameters that change.
TEST(DesignConfig, TakesACorrectedVehicle) {
  model::Vehicle corrected = test::nominal();
  corrected.effects["wing_damage"] = {{"left_area", 0.04}, {"right_area", 0.0}};
  corrected.posterior = model::Posterior{{"torso.mass_kg"}, {corrected.torso.mass_kg}, {{1e-12}}};
  const flight::Folder folder;
  const std::string file = folder.write("corrected.toml", model::vehicle_text(corrected));
  const Space s = small_config({"vehicle=" + file}).judge.space;
  Values longer = s.built;
  value_of(longer, Quantity::wing_length) -= 0.002;
  for (const Values& values : {s.built, longer}) {
    const Robot r = build(s, values);
    EXPECT_EQ(r.refused, "");
    EXPECT_EQ(r.vehicle.effects.at("wing_damage").at("left_area"), 0.04);
    EXPECT_FALSE(r.vehicle.posterior);
  }
}

TEST(DesignConfig, RefusesInOneLine) {
  const auto refused = [](const std::string& override, const std::string& expected) {
    const std::string line = test::refusal([&] { small_config({override}); });
    EXPECT_NE(line.find(expected), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  };
  refused("vary.wing_lenght_m={low=0.05,high=0.06}", "did you mean \"wing_length_m\"");
  refused("vary.wing_length_m={low=0.07,high=0.06}", "is not above low");
  refused("vary.motor=[\"no_such_motor\", \"x\"]", "no motor \"no_such_motor\"");
  refused("built.motor=none", "no motor \"none\"");
  refused("search.population=10", "multiple of four");
  refused("search.method=\"best\"", "nsga2");
  refused("hover=\"../fly/hover_arc.toml\"", "pid");
  refused("escape=\"../fly/hover.toml\"", "defines no success");
  refused("workshop.rods_m=[0.3e-3]", "the built robot cannot be built");
  refused("verify.tune=\"../tune/arc.toml\"", "another kind of controller");
}

}  // namespace
}  // namespace flappy::design
