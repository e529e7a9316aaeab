#include "design/robot.hpp"

#include <algorithm>
#include <cmath>

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

Mass placed(Mass m, const model::Triple& at) {
  const auto& h = m.first_kg_m;
  m.second_kg_m2.xx += 2 * h.x * at.x, m.second_kg_m2.yy += 2 * h.y * at.y, m.second_kg_m2.zz += 2 * h.z * at.z;
  m.second_kg_m2.xy += h.x * at.y + h.y * at.x;
  m.second_kg_m2.yz += h.y * at.z + h.z * at.y;
  m.second_kg_m2.xz += h.x * at.z + h.z * at.x;
  const Mass point = point_mass(m.mass_kg, at);
  m.first_kg_m = m.first_kg_m + point.first_kg_m;
  m.second_kg_m2 = m.second_kg_m2 + point.second_kg_m2;
  return m;
}

model::Triple sum(const model::Triple& a, const model::Triple& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

/// The number of ten digits next to x: 0.7 instead of 0.7000000000000001.
double readable(double x) { return std::stod(io::format("%.10g", x)); }

std::string millimetres(double m) { return io::format("%.1f mm", 1e3 * m); }

std::string motor_names(const std::vector<MotorType>& motors) {
  std::vector<std::string> names;
  for (const MotorType& m : motors) names.push_back(io::toml_string(m.name));
  return io::joined(names);
}

bool is_same(const WingShape& a, const WingShape& b) {
  return a.length_m == b.length_m && a.mean_chord_m == b.mean_chord_m && a.root_chord == b.root_chord &&
         a.tip_chord == b.tip_chord;
}

bool is_same(const model::Triple& a, const model::Triple& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

void put_motor(const MotorType& type, model::Motor& motor) {
  motor.resistance_ohm = type.resistance_ohm;
  motor.torque_constant_Nm_A = type.torque_constant_Nm_A;
  motor.rotor_inertia_kg_m2 = type.rotor_inertia_kg_m2;
  motor.friction_Nm = type.friction_Nm;
  motor.damping_Nm_s = type.damping_Nm_s;
}

/// Smallest rod in stock that is stiff enough; 0: there is none.
double rod_for(const Workshop& w, double length_m, double built_length_m) {
  const double least = stiff_diameter_m(length_m, built_length_m, w.built_rod_m);
  for (const double d : w.rods_m)
    if (d >= least * (1 - 1e-9)) return d;
  return 0;
}

/// One side of the robot, +1 left or -1 right, and what it changes of the torso.
void build_side(const Space& space, const Robot& robot, int side, model::Side& s, Mass& torso) {
  const Workshop& w = space.workshop;
  const model::Side& was = side > 0 ? space.published.left : space.published.right;
  const WingShape was_shape = shape_of(was.planform);
  const auto value = [&](Quantity q) { return value_of(robot.values, q); };
  Mass edge = mass_of(was.leading_edge);
  if (!is_same(robot.wing, was_shape)) {
    s.planform = planform_of(robot.wing, was.planform.rotational_damping_coefficient);
    s.wing =
        body_of(mass_of(was.wing).add(panel_of(robot.wing, w.panel, side)).add(panel_of(was_shape, w.panel, side), -1));
    edge.add(rod_of(robot.wing.length_m, robot.rod_m, w.rod_kg_m3, side))
        .add(rod_of(was_shape.length_m, w.built_rod_m, w.rod_kg_m3, side), -1);
    s.leading_edge = body_of(edge);
  }
  if (value(Quantity::gear_ratio) != was.motor.gear_ratio) {
    const double built_m = w.pinion_m * was.motor.gear_ratio, wheel_m = w.pinion_m * value(Quantity::gear_ratio);
    edge.add(wheel_of(wheel_m, built_m, w.built_wheel_kg_m2)).add(wheel_of(built_m, built_m, w.built_wheel_kg_m2), -1);
    s.leading_edge = body_of(edge);
  }
  s.shoulder_m = {value(Quantity::shoulder_x), side * value(Quantity::shoulder_y), value(Quantity::shoulder_z)};
  s.spring.stiffness_positive_Nm_rad = s.spring.stiffness_negative_Nm_rad = value(Quantity::spring);
  s.spring.rest_angle_rad = value(Quantity::rest_angle);
  s.rotation.upper_rad = value(Quantity::rotation_stop);
  s.rotation.lower_rad = -value(Quantity::rotation_stop);
  if (value(Quantity::motor) != value_of(space.built, Quantity::motor)) put_motor(*robot.motor, s.motor);
  s.motor.gear_ratio = value(Quantity::gear_ratio);
  s.motor.voltage_limit_V = robot.vehicle.driver.amplitude_limit_V;
  const model::Triple motor{w.motor_m.x, side * w.motor_m.y, w.motor_m.z};
  if (robot.motor == &w.motors[w.built_motor] && is_same(s.shoulder_m, was.shoulder_m)) return;
  torso.add(point_mass(robot.motor->mass_kg, sum(s.shoulder_m, motor)))
      .add(point_mass(w.motors[w.built_motor].mass_kg, sum(was.shoulder_m, motor)), -1);
}

std::string refusal(const Space& space, const Robot& r) {
  const Workshop& w = space.workshop;
  const double narrowest = least_chord(r.wing) * r.wing.mean_chord_m;
  if (!(narrowest >= w.least_chord_m))
    return "the wing is " + millimetres(narrowest) + " narrow, less than " + millimetres(w.least_chord_m);
  if (!(w.panel.hub_m < r.wing.length_m / 2)) return "the hub takes half of the wing";
  if (r.rod_m == 0) return "no rod in stock is stiff enough for a wing of " + millimetres(r.wing.length_m);
  const double cells = value_of(r.values, Quantity::cells), battery = value_of(r.values, Quantity::battery);
  if ((cells > 0) != (battery > 0)) return cells > 0 ? "a battery without mass" : "a battery without cells";
  if (!(r.vehicle.torso.mass_kg > 0)) return "the motors weigh more than the torso of the built robot allows";
  // at the end of its stroke a leading edge lies along x at the shoulder's y
  if (const double apart = 2 * value_of(r.values, Quantity::shoulder_y); !(apart >= w.wing_clearance_m))
    return "the wings are " + millimetres(apart) + " apart at the ends of their strokes, less than " +
           millimetres(w.wing_clearance_m);
  if (const double wheel_m = w.pinion_m * value_of(r.values, Quantity::gear_ratio);
      !(wheel_m < value_of(r.values, Quantity::shoulder_y)))
    return "the wheels of the gears, " + millimetres(wheel_m) + " in radius, do not fit beside each other";
  if (const auto fault = model::physical_fault(r.vehicle)) return fault->path + " " + fault->what;
  model::Vehicle copy = r.vehicle;
  for (const model::Parameter& p : model::parameters(copy))
    if (!(*p.value >= p.low && *p.value <= p.high))
      return p.path + " is " + io::shortest_digits(*p.value) + ", not in [" + io::shortest_digits(p.low) + ", " +
             io::shortest_digits(p.high) + "]";
  return "";
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

Robot build(const Space& space, const Values& values) {
  const Workshop& w = space.workshop;
  const model::Vehicle& was = space.published;
  const auto value = [&](Quantity q) { return value_of(values, q); };
  Robot r;
  r.values = values;
  r.vehicle = was;
  r.vehicle.posterior.reset();
  r.motor = &w.motors[static_cast<std::size_t>(value(Quantity::motor))];
  r.wing = {value(Quantity::wing_length), value(Quantity::mean_chord), value(Quantity::root_chord),
            value(Quantity::tip_chord)};
  r.rod_m = rod_for(w, r.wing.length_m, was.left.planform.wing_length_m);
  model::Driver& driver = r.vehicle.driver;
  driver.flapping_Hz = value(Quantity::frequency);
  if (value(Quantity::cells) > 0) driver.amplitude_limit_V = w.cell_V * value(Quantity::cells);
  r.battery_J = w.battery_J_kg * value(Quantity::battery);
  Mass more = point_mass(value(Quantity::battery), w.battery_m);  // than the built torso
  build_side(space, r, +1, r.vehicle.left, more);
  build_side(space, r, -1, r.vehicle.right, more);
  if (more.second_kg_m2.xx != 0 || more.second_kg_m2.yy != 0 || more.second_kg_m2.zz != 0)
    r.vehicle.torso = body_of(mass_of(was.torso).add(more));
  const auto longer = [&](Quantity q) { return value(q) - value_of(space.built, q); };
  r.vehicle.extent.around_m += longer(Quantity::wing_length) + longer(Quantity::shoulder_y);
  r.vehicle.extent.above_m = std::max(0.0, r.vehicle.extent.above_m + longer(Quantity::shoulder_z));
  r.refused = refusal(space, r);
  return r;
}

WholeBody whole_body(const model::Vehicle& v) {
  Mass all = mass_of(v.torso);
  for (const model::Side* s : {&v.left, &v.right})
    all.add(placed(mass_of(s->leading_edge).add(mass_of(s->wing)), s->shoulder_m));
  const model::RigidBody body = body_of(all);
  return {body.mass_kg, body.com_m, body.inertia_kg_m2};
}

Space read_space(const io::Table& root) {
  Space s;
  const std::filesystem::path file = root.file("vehicle");
  s.published = model::read_vehicle(file);
  if (!s.published.contact.empty() || !s.published.effects.empty())
    root.fail("vehicle", "has points of contact or effects", "a vehicle of wings, motors and bodies alone");
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
  return s;
}

}  // namespace flappy::design
