#include "model/changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::model {
namespace {

TEST(Changes, SwapWingsButNotMotors) {
  const Vehicle nominal = test::nominal();
  Vehicle v = nominal;
  v.left.wing.mass_kg *= 1.1;
  v.left.wing.com_m.y *= 1.05;
  v.left.planform.mean_chord_m *= 0.9;
  v.left.motor.resistance_ohm *= 1.2;
  v.effects["wing_damage"] = {{"left_area", 0.05}, {"right_area", 0.01}};
  const Vehicle before = v;
  const Changes swap{.swapped_wings = true};
  apply(swap, v);
  EXPECT_EQ(v.right.wing.mass_kg, before.left.wing.mass_kg);
  EXPECT_EQ(v.right.wing.com_m.y, -before.left.wing.com_m.y);
  EXPECT_EQ(v.right.planform.mean_chord_m, before.left.planform.mean_chord_m);
  EXPECT_EQ(v.left.motor.resistance_ohm, before.left.motor.resistance_ohm);
  EXPECT_EQ(v.effects["wing_damage"]["right_area"], 0.05);
  EXPECT_EQ(v.effects["wing_damage"]["left_area"], 0.01);
  apply(swap, v);
  Vehicle same = before;
  for (const Parameter& p : parameters(v)) {
    const auto all = parameters(same);
    const auto at = std::ranges::find(all, p.path, &Parameter::path);
    EXPECT_EQ(*p.value, *at->value) << p.path;
  }
  // the published robot is the same on both sides, but for 5 um of the wings' centres
  Vehicle swapped = nominal, whole = nominal;
  apply(swap, swapped);
  const auto are = parameters(swapped), were = parameters(whole);
  for (std::size_t i = 0; i < are.size(); ++i) EXPECT_NEAR(*are[i].value, *were[i].value, 5e-6) << are[i].path;
}

// Two points of equal mass: their centre in the middle, m d^2 / 2 about it, which a second weight in the middle leaves.
TEST(Changes, AddAWeight) {
  Vehicle v = test::nominal();
  v.torso = {1e-3, {0, 0, 0}, {}};
  apply({.added_mass_kg = 1e-3, .added_at_m = {0.02, 0, 0}}, v);
  EXPECT_DOUBLE_EQ(v.torso.mass_kg, 2e-3);
  EXPECT_DOUBLE_EQ(v.torso.com_m.x, 0.01);
  EXPECT_DOUBLE_EQ(v.torso.inertia_kg_m2.yy, 0.5 * 1e-3 * 0.02 * 0.02);
  EXPECT_DOUBLE_EQ(v.torso.inertia_kg_m2.xx, 0);
  apply({.added_mass_kg = 1e-3, .added_at_m = {0.01, 0, 0}}, v);
  EXPECT_DOUBLE_EQ(v.torso.inertia_kg_m2.yy, 0.5 * 1e-3 * 0.02 * 0.02);
  v.torso = {1e-3, {0, 0, 0}, {}};
  apply({.added_mass_kg = 1e-3, .added_at_m = {0.02, 0.02, 0}}, v);
  EXPECT_DOUBLE_EQ(v.torso.inertia_kg_m2.xy, -0.5 * 1e-3 * 0.02 * 0.02) << "as in a URDF";
}

TEST(Changes, AreReadAsTheyAreWritten) {
  const Changes all{
      .swapped_wings = true, .added_mass_kg = 5e-4, .added_at_m = {0.02, 0, -0.01}, .without = {"tether"}};
  const auto read = [](const std::string& text) { return read_changes(io::Config::parse(text, "flight.toml").root()); };
  EXPECT_EQ(read(changes_text(all)), all);
  EXPECT_EQ(changes_text({}), "");
  EXPECT_FALSE(read("schema = 1\n").any());
  EXPECT_TRUE(test::refusal([&] {
                read("[changes]\nwithout = [\"thether\"]\n");
              }).starts_with("flight.toml:2:11: changes.without: no effect \"thether\""));
}

}  // namespace
}  // namespace flappy::model
