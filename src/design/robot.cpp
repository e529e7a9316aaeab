#include "design/robot.hpp"

#include <algorithm>
#include <cmath>

#include "io/text.hpp"

namespace flappy::design {
namespace {

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

std::string millimetres(double m) { return io::format("%.1f mm", 1e3 * m); }

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
  const double wheel_m = w.pinion_m * value_of(r.values, Quantity::gear_ratio) + w.module_m;
  if (!(2 * wheel_m + w.wheel_clearance_m <= 2 * value_of(r.values, Quantity::shoulder_y)))
    return "the wheels of the gears, " + millimetres(wheel_m) +
           " in radius with their teeth, do not fit beside each other";
  if (const auto fault = model::physical_fault(r.vehicle)) return fault->path + " " + fault->what;
  model::Vehicle copy = r.vehicle;
  for (const model::Parameter& p : model::parameters(copy))
    if (!(*p.value >= p.low && *p.value <= p.high))
      return p.path + " is " + io::shortest_digits(*p.value) + ", not in [" + io::shortest_digits(p.low) + ", " +
             io::shortest_digits(p.high) + "]";
  return "";
}

}  // namespace

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

}  // namespace flappy::design
