// The design space and its configuration.
#include <algorithm>
#include <cmath>

#include "design/robot.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"

namespace flappy::design {
namespace {

constexpr QuantityInfo kQuantityInfos[kQuantities] = {
    {"wing_length_m", "wing length, shoulder to tip", 0.02, 0.2},
    {"mean_chord_m", "mean chord", 0.005, 0.1},
    {"root_chord", "chord at the root over the mean chord", 0, 3},
    {"tip_chord", "chord at the tip over the mean chord", 0, 3},
    {"spring_Nm_rad", "stiffness of the stroke spring", 0, 1},
    {"rest_angle_rad", "rest angle of the stroke spring", -1, 1},
    {"gear_ratio", "gear ratio", 1, 100},
    {"flapping_Hz", "frequency of the beat", 5, 100},
    {"rotation_stop_rad", "angle of the rotation stops", 0.1, 1.5},
    {"shoulder_x_m", "shoulder forward", -0.05, 0.05},
    {"shoulder_y_m", "shoulder outward", 0.002, 0.1},
    {"shoulder_z_m", "shoulder upward", -0.1, 0.1},
    {"motor", "motor", 0, 0},
    {"cells", "cells of the battery in series; 0: on a wire", 0, 10},
    {"battery_kg", "mass of the battery", 0, 0.05},
};

/// The number of ten digits next to x: 0.7 instead of 0.7000000000000001.
double readable(double x) { return std::stod(io::format("%.10g", x)); }

std::string motor_names(const std::vector<MotorType>& motors) {
  std::vector<std::string> names;
  for (const MotorType& m : motors) names.push_back(io::toml_string(m.name));
  return io::joined(names);
}

MotorType read_motor(const io::Table& t) {
  MotorType m;
  m.name = t.string("name");
  m.source = t.string("source");
  m.mass_kg = t.number("mass_kg", io::positive(0.1));
  m.resistance_ohm = t.number("resistance_ohm", io::positive(1e3));
  m.torque_constant_Nm_A = t.number("torque_constant_Nm_A", io::positive(1));
  m.rotor_inertia_kg_m2 = t.number("rotor_inertia_kg_m2", io::positive(1e-3));
  m.friction_Nm = t.number("friction_Nm", io::non_negative(1));
  m.damping_Nm_s = t.number("damping_Nm_s", io::non_negative(1));
  m.current_limit_A = t.number("current_limit_A", io::positive(100));
  m.winding_K_W = t.number("winding_K_W", io::positive(1e4));
  m.housing_K_W = t.number("housing_K_W", io::positive(1e4));
  m.winding_s = t.number("winding_s", io::positive(1e5));
  m.housing_s = t.number("housing_s", io::positive(1e5));
  m.winding_limit_C = t.number("winding_limit_C", io::positive(300));
  return m;
}

Workshop read_workshop(const io::Table& root) {
  Workshop w;
  const auto triple = [](const io::Table& t, const char* key) {
    const std::vector<double> v = t.numbers(key, 3, {-1, 1});
    return model::Triple{v[0], v[1], v[2]};
  };
  const io::Table catalogue = io::Config::load(root.file("motors")).root();
  catalogue.schema(1);
  for (const io::Table& t : catalogue.tables("motor")) {
    w.motors.push_back(read_motor(t));
    for (std::size_t i = 0; i + 1 < w.motors.size(); ++i)
      if (w.motors[i].name == w.motors.back().name) t.fail("name", "is there twice", "a name for each motor");
  }
  catalogue.finish();
  if (w.motors.empty()) catalogue.fail("motor", "is missing", "at least one [[motor]]");
  const io::Table built = root.table("built");
  const std::string name = built.string("motor");
  w.built_motor = static_cast<std::size_t>(std::ranges::find(w.motors, name, &MotorType::name) - w.motors.begin());
  if (w.built_motor == w.motors.size()) built.fail("motor", "no motor " + io::toml_string(name), motor_names(w.motors));
  w.motor_m = triple(built, "motor_m");
  w.battery_m = triple(built, "battery_m");
  w.panel.hub_m = built.number("hub_m", io::non_negative(0.1));
  w.panel.sleeve_m = built.number("sleeve_m", io::non_negative(0.1));
  w.built_rod_m = built.number("rod_m", io::positive(0.1));
  w.built_wheel_kg_m2 = built.number("wheel_kg_m2", io::non_negative(1e-3));
  const io::Table shop = root.table("workshop");
  w.rods_m = shop.numbers("rods_m", io::positive(0.1));
  std::ranges::sort(w.rods_m);
  w.rod_kg_m3 = shop.number("rod_kg_m3", io::positive(1e5));
  w.least_chord_m = shop.number("least_chord_m", io::positive(0.1));
  w.wing_clearance_m = shop.number("wing_clearance_m", io::non_negative(0.1));
  w.pinion_m = shop.number("pinion_m", io::positive(0.1));
  w.module_m = shop.number("module_m", io::positive(0.01));
  w.wheel_clearance_m = shop.number("wheel_clearance_m", io::non_negative(0.1));
  w.battery_J_kg = shop.number("battery_J_kg", io::positive(1e7));
  w.cell_V = shop.number("cell_V", io::positive(10));
  w.ambient_C = shop.number("ambient_C", {-50, 100});
  w.flight_s = shop.number("flight_s", io::positive(1e6));
  return w;
}

Variable read_variable(const io::Table& vary, const std::string& key, const Workshop& workshop) {
  std::vector<std::string> names;
  for (const QuantityInfo& i : kQuantityInfos) names.emplace_back(i.name);
  const auto at = std::ranges::find(names, key);
  if (at == names.end())
    vary.fail(key, "nothing of a robot has this name", io::joined(names) + io::did_you_mean(key, names));
  Variable v{static_cast<Quantity>(at - names.begin()), 0, 0, 0, {}};
  if (v.quantity == Quantity::motor) {
    for (const std::string& name : vary.strings(key)) {
      const auto found = std::ranges::find(workshop.motors, name, &MotorType::name);
      if (found == workshop.motors.end())
        vary.fail(key, "no motor " + io::toml_string(name), motor_names(workshop.motors));
      v.choices.push_back(static_cast<std::size_t>(found - workshop.motors.begin()));
    }
    if (v.choices.size() < 2) vary.fail(key, "has no choice", "at least two names of motors");
    v.high = static_cast<double>(v.choices.size()) - 1;
    v.step = 1;
    return v;
  }
  const QuantityInfo& info = info_of(v.quantity);
  const io::Table t = vary.table(key);
  t.accept({"low", "high", "step"});
  v.low = t.number("low", {info.low, info.high});
  v.high = t.number("high", {info.low, info.high});
  if (!(v.high > v.low)) t.fail("high", "is not above low", "a range");
  v.step = v.quantity == Quantity::cells ? 1 : t.number_or("step", 0, {0, v.high - v.low});
  if (v.quantity == Quantity::cells && (v.low != std::round(v.low) || v.high != std::round(v.high)))
    t.fail("low", "is no whole number of cells, or high is not", "whole numbers");
  return v;
}

Values built_values(const model::Vehicle& v, const Workshop& w) {
  const WingShape shape = shape_of(v.left.planform);
  return {shape.length_m,
          shape.mean_chord_m,
          shape.root_chord,
          shape.tip_chord,
          v.left.spring.stiffness_positive_Nm_rad,
          v.left.spring.rest_angle_rad,
          v.left.motor.gear_ratio,
          v.driver.flapping_Hz,
          v.left.rotation.upper_rad,
          v.left.shoulder_m.x,
          v.left.shoulder_m.y,
          v.left.shoulder_m.z,
          static_cast<double>(w.built_motor),
          0,
          0};
}

}  // namespace

const QuantityInfo& info_of(Quantity quantity) { return kQuantityInfos[static_cast<std::size_t>(quantity)]; }

Values Space::values(const std::vector<double>& unit) const {
  Values all = built;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const Variable& v = variables[i];
    double x = v.low + std::clamp(unit[i], 0.0, 1.0) * (v.high - v.low);
    if (v.step > 0) x = readable(std::min(v.low + std::round((x - v.low) / v.step) * v.step, v.high));
    if (!v.choices.empty()) x = static_cast<double>(v.choices[static_cast<std::size_t>(x)]);
    value_of(all, v.quantity) = x;
  }
  return all;
}

std::vector<double> Space::unit(const Values& all) const {
  std::vector<double> u;
  for (const Variable& v : variables) {
    double x = value_of(all, v.quantity);
    if (!v.choices.empty())
      x = static_cast<double>(std::ranges::find(v.choices, static_cast<std::size_t>(x)) - v.choices.begin());
    u.push_back(std::clamp((x - v.low) / (v.high - v.low), 0.0, 1.0));
  }
  return u;
}

Space read_space(const io::Table& root) {
  Space s;
  const std::filesystem::path file = root.file("vehicle");
  s.published = model::read_vehicle(file);
  if (!s.published.contact.empty()) root.fail("vehicle", "has points of contact", "a vehicle without contact");
  s.published.posterior.reset();  // designs change the parameters that it describes
  s.workshop = read_workshop(root);
  s.built = built_values(s.published, s.workshop);
  // the areal density is what makes the law's panel as heavy as the built wing
  Panel& panel = s.workshop.panel;
  panel.kg_m2 = 1;
  panel.kg_m2 = s.published.left.wing.mass_kg / panel_of(shape_of(s.published.left.planform), panel, 1).mass_kg;
  const io::Table vary = root.table("vary");
  for (const std::string& key : vary.keys()) s.variables.push_back(read_variable(vary, key, s.workshop));
  if (s.variables.empty()) root.fail("vary", "is empty", "at least one quantity with low and high");
  std::ranges::sort(s.variables, {}, &Variable::quantity);
  const Robot same = build(s, s.built);
  if (!same.refused.empty())
    root.fail("built", "the built robot cannot be built: " + same.refused, "a workshop that can build it");
  model::Vehicle published = s.published, built = same.vehicle;
  const std::vector<model::Parameter> was = model::parameters(published), is = model::parameters(built);
  for (std::size_t i = 0; i < std::min(was.size(), is.size()); ++i)
    if (std::abs(*was[i].value - *is[i].value) > 1e-6 * std::abs(*was[i].value) + 1e-12)
      root.fail("vehicle", "its " + was[i].path + " is not that of the other side, or not symmetric about 0",
                "a vehicle that is the same left and right");
  return s;
}

}  // namespace flappy::design
