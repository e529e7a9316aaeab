#include "model/changes.hpp"

#include <algorithm>
#include <utility>

#include "io/config.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "model/effects/add_mass.hpp"
#include "model/effects/registry.hpp"

namespace flappy::model {
namespace {

/// Swaps bodies of both sides, mirrored in the plane of symmetry, y = 0.
void swap_mirrored(RigidBody& left, RigidBody& right) {
  std::swap(left, right);
  for (RigidBody* b : {&left, &right}) {
    b->com_m.y = -b->com_m.y;
    b->inertia_kg_m2.xy = -b->inertia_kg_m2.xy;
    b->inertia_kg_m2.yz = -b->inertia_kg_m2.yz;
  }
}

/// Effects whose parameters are of one wing: "left_..." of the left.
void swap_effects(Vehicle& v) {
  for (auto& [id, values] : v.effects)
    for (auto& [name, value] : values)
      if (name.starts_with("left_"))
        if (const auto right = values.find("right_" + name.substr(5)); right != values.end())
          std::swap(value, right->second);
}

}  // namespace

Changes read_changes(const io::Table& root) {
  Changes c;
  const auto table = root.optional_table("changes");
  if (!table) return c;
  c.swapped_wings = table->boolean_or("swapped_wings", false);
  if (table->has("added_mass_kg")) {
    c.added_mass_kg = table->number("added_mass_kg", io::positive(1));
    const std::vector<double> at = table->numbers("added_at_m", 3, io::Range{-1, 1});
    std::ranges::copy(at, c.added_at_m.begin());
  }
  if (table->has("without")) c.without = table->strings("without");
  for (const std::string& id : c.without)
    if (!is_effect(id)) table->fail("without", "no effect \"" + id + "\"", "those that flappy-gap effects lists");
  return c;
}

std::string changes_text(const Changes& c) {
  if (!c.any()) return "";
  std::string text = "\n[changes]\n", list;
  if (c.swapped_wings) text += "swapped_wings = true\n";
  if (c.added_mass_kg > 0) {
    text += "added_mass_kg = " + io::toml_number(c.added_mass_kg) + "\n";
    for (const double x : c.added_at_m) list += (list.empty() ? "" : ", ") + io::toml_number(x);
    text += "added_at_m = [" + list + "]\n";
  }
  list.clear();
  for (const std::string& id : c.without) list += (list.empty() ? "" : ", ") + io::toml_string(id);
  if (!list.empty()) text += "without = [" + list + "]\n";
  return text;
}

std::string in_words(const Changes& c) {
  std::vector<std::string> done;
  if (c.swapped_wings) done.emplace_back("swap the wings");
  if (c.added_mass_kg > 0)
    done.push_back(io::format("add %g g at (%g, %g, %g) mm", 1e3 * c.added_mass_kg, 1e3 * c.added_at_m[0],
                              1e3 * c.added_at_m[1], 1e3 * c.added_at_m[2]));
  if (!c.without.empty()) done.push_back("take off " + io::joined(c.without));
  std::string text;
  for (const std::string& d : done) text += (text.empty() ? "" : "; ") + d;
  return text;
}

void apply(const Changes& c, Vehicle& v) {
  if (c.swapped_wings) {
    swap_mirrored(v.left.leading_edge, v.right.leading_edge);
    swap_mirrored(v.left.wing, v.right.wing);
    std::swap(v.left.rotation, v.right.rotation);
    std::swap(v.left.planform, v.right.planform);
    swap_effects(v);
  }
  if (c.added_mass_kg > 0) {
    const double at[] = {c.added_at_m[0], c.added_at_m[1], c.added_at_m[2]};
    add_mass(c.added_mass_kg, at, v.torso);
  }
  for (const std::string& id : c.without) v.effects.erase(id);
}

}  // namespace flappy::model
