#include "model/derive.hpp"

#include <cmath>
#include <numbers>

#include "model/chord.hpp"
#include "model/effects/registry.hpp"

namespace flappy::model {
namespace {

Vec3<double> vec(const Triple& t) { return {t.x, t.y, t.z}; }

Sym3<double> outer(double mass, const Vec3<double>& r) {
  return {mass * r.x * r.x, mass * r.y * r.y, mass * r.z * r.z, mass * r.x * r.y, mass * r.y * r.z, mass * r.x * r.z};
}

}  // namespace

Vec3<double> first_moment(const RigidBody& b) { return b.mass_kg * vec(b.com_m); }

/// Second moment of mass about the frame's origin from the inertia I about the centre of mass: tr(I)/2 1 - I + m c c^T.
Sym3<double> second_moment(const RigidBody& b) {
  const InertiaTensor& i = b.inertia_kg_m2;
  const double half = (i.xx + i.yy + i.zz) / 2;
  const Sym3<double> about_com{half - i.xx, half - i.yy, half - i.zz, -i.xy, -i.yz, -i.xz};
  return about_com + outer(b.mass_kg, vec(b.com_m));
}

namespace {

/// S of motor.hpp; and the second moment of mass of a disc about z whose inertia is `inertia`.
double rotor_spin(const Motor& m) { return m.rotor_spin_sense * m.gear_ratio * m.rotor_inertia_kg_m2; }
Sym3<double> disc(double inertia) { return {inertia / 2, inertia / 2, 0, 0, 0, 0}; }

double wing_mass(const Side& s) { return s.leading_edge.mass_kg + s.wing.mass_kg; }

void put_planform(const Planform& w, double air_density, SideParameters<double>& p) {
  const double R = w.wing_length_m, c = w.mean_chord_m;
  const double pressure = 0.5 * air_density;
  p.force2 = pressure * c * R * R * R * w.r22;
  p.force1 = 2 * pressure * c * R * R * w.r11;
  p.force0 = pressure * c * R * w.r00;
  p.moment2 = pressure * c * c * R * R * R * w.z_cp2;
  p.moment1 = 2 * pressure * c * c * R * R * w.z_cp1;
  p.moment0 = pressure * c * c * R * w.z_cp0;
  p.rotational_damping_Nm_s2 = 0.125 * air_density * w.rotational_damping_coefficient * R * c * c * c * c * w.z_rd;
  p.span_to_pressure_m = R * w.r33 / w.r22;
}

SideParameters<double> derive_side(const Side& s, double air_density, double step_s) {
  SideParameters<double> p;
  p.shoulder_m = vec(s.shoulder_m);
  p.edge_moment_kg_m = first_moment(s.leading_edge);
  p.edge_second_kg_m2 = second_moment(s.leading_edge) + disc(rotor_spin(s.motor));
  p.wing_moment_kg_m = first_moment(s.wing);
  p.wing_second_kg_m2 = second_moment(s.wing);
  put_planform(s.planform, air_density, p);

  const Motor& m = s.motor;
  const double N = m.gear_ratio, K = m.torque_constant_Nm_A;
  p.stroke_torque_per_V_Nm = N * m.efficiency * K / m.resistance_ohm;
  p.stroke_damping_Nm_s = m.efficiency * N * N * (K * K / m.resistance_ohm + m.damping_Nm_s) + s.stroke.damping_Nm_s;
  p.stroke_friction_Nm = m.efficiency * N * m.friction_Nm + s.stroke.friction_Nm;
  p.rotor_kg_m2 = m.efficiency * N * N * m.rotor_inertia_kg_m2 - rotor_spin(m);
  p.voltage_limit_V = m.voltage_limit_V;
  p.spring_positive_Nm_rad = s.spring.stiffness_positive_Nm_rad;
  p.spring_negative_Nm_rad = s.spring.stiffness_negative_Nm_rad;
  p.spring_rest_rad = s.spring.rest_angle_rad;
  p.stroke_lower_rad = s.stroke.lower_rad;
  p.stroke_upper_rad = s.stroke.upper_rad;
  p.rotation_lower_rad = s.rotation.lower_rad;
  p.rotation_upper_rad = s.rotation.upper_rad;
  p.rotation_damping_Nm_s = s.rotation.damping_Nm_s;
  p.rotation_friction_Nm = s.rotation.friction_Nm;
  p.stroke_stiffening_kg_m2 = step_s / 2 * p.stroke_damping_Nm_s;
  return p;
}

/// Means over the span of c^3 and c^3 x, with c the chord per mean chord and x = r/R, which a planform does not state.
/// The chord is approximated by QuadraticChord and integrated by Gauss's rule with five points, exact for these powers.
/// The error of the quadratic in the stated means of c^2, c^2 x and c^4, between which c^3 lies, is corrected half and
/// half:
///   <c^3> sqrt(z_cp0/<c^2> z_rd/<c^4>)      <c^3 x> z_cp1/<c^2 x> sqrt(z_rd/<c^4> <c^2>/z_cp0)
/// Exact for chords that are linear or quadratic; 0.1 % off for the shipped wings, 0.4 % for an ellipse, 2 % (of c^3 x)
/// for shipped wings that lost 15 % at the tip.
struct ChordCubed {
  double mean = 0, with_span = 0;
};
ChordCubed chord_cubed(const Planform& w) {
  constexpr double kPoint[] = {-0.90617984593866399, -0.53846931010568309, 0, 0.53846931010568309, 0.90617984593866399};
  constexpr double kWeight[] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324,
                                0.11846344252809454};
  const QuadraticChord chord(w);
  ChordCubed cubed;
  double c2 = 0, c2x = 0, c4 = 0;
  for (int i = 0; i < 5; ++i) {
    const double y = kPoint[i], x = (1 + y) / 2, c = chord.at(y), area2 = kWeight[i] * c * c;
    c2 += area2;
    c2x += area2 * x;
    c4 += area2 * c * c;
    cubed.mean += area2 * c;
    cubed.with_span += area2 * c * x;
  }
  cubed.mean *= std::sqrt(w.z_cp0 / c2 * w.z_rd / c4);
  cubed.with_span *= w.z_cp1 / c2x * std::sqrt(w.z_rd / c4 * c2 / w.z_cp0);
  return cubed;
}

SideConstants<double> side_constants(const Side& s, double air_density) {
  const Motor& m = s.motor;
  const Planform& w = s.planform;
  const double K = m.torque_constant_Nm_A * m.gear_ratio, R = w.wing_length_m, c = w.mean_chord_m;
  const double strip = air_density * std::numbers::pi / 4 * c * c * R;
  const ChordCubed cubed = chord_cubed(w);
  return {m.resistance_ohm,
          K,
          m.efficiency * K * K / m.resistance_ohm,
          rotor_spin(m),
          R,
          c,
          strip * w.z_cp0,
          strip * c * cubed.mean / 2,
          strip * R * w.z_cp1,
          strip * c * c * w.z_rd * (1.0 / 4 + 1.0 / 32),
          strip * R * R * w.z_cp2,
          strip * R * c * cubed.with_span / 2};
}

}  // namespace

SideParameters<double> derive_planform(const Planform& planform, double air_density) {
  SideParameters<double> p{};
  put_planform(planform, air_density, p);
  return p;
}

Vehicle built(Vehicle v) {
  const auto given = v.effects;
  for (const CatalogueEffect& e : catalogue_of(v)) {
    const auto own = given.find(e.info.id);
    if (e.change == nullptr || own == given.end()) continue;
    const std::vector<double> values = e.values(own->second);
    if (e.acts(values)) e.change(values.data(), v);
  }
  return v;
}

Sides<SideConstants<double>> effect_constants(const Vehicle& vehicle) {
  if (vehicle.beat_averaged || vehicle.jointed) return {};
  const Vehicle v = built(vehicle);
  return {side_constants(v.left, v.air_density_kg_m3), side_constants(v.right, v.air_density_kg_m3)};
}

double total_mass_kg(const Vehicle& vehicle) {
  const Vehicle v = built(vehicle);
  return v.torso.mass_kg + wing_mass(v.left) + wing_mass(v.right);
}

Parameters<double> derive(const Vehicle& vehicle, double step_s) {
  const Vehicle v = built(vehicle);
  Parameters<double> p{};
  if (v.jointed) {  // the step of articulated wings takes its masses from JointedParameters
    if (v.jointed->left.strips.empty()) p.left = derive_planform(v.left.planform, v.air_density_kg_m3);
    if (v.jointed->right.strips.empty()) p.right = derive_planform(v.right.planform, v.air_density_kg_m3);
  } else if (!v.beat_averaged) {
    p.left = derive_side(v.left, v.air_density_kg_m3, step_s);
    p.right = derive_side(v.right, v.air_density_kg_m3, step_s);
  }
  p.inverse_mass_1_kg = 1 / (v.torso.mass_kg + wing_mass(v.left) + wing_mass(v.right));
  if (!v.jointed) {  // zero moments of articulated wings make the velocity in State that of the origin
    p.fixed_moment_kg_m =
        first_moment(v.torso) + (wing_mass(v.left) * p.left.shoulder_m + wing_mass(v.right) * p.right.shoulder_m);
    p.fixed_second_kg_m2 =
        second_moment(v.torso) + disc(-rotor_spin(v.left.motor) - rotor_spin(v.right.motor)) +
        (outer(wing_mass(v.left), p.left.shoulder_m) + outer(wing_mass(v.right), p.right.shoulder_m));
  }
  p.air_density_kg_m3 = v.air_density_kg_m3;
  p.below_m = v.extent.below_m;
  p.above_m = v.extent.above_m;
  p.around_m = v.extent.around_m;
  p.beat_steps = 2 / (beats_Hz(v) * step_s);
  return p;
}

double beats_Hz(const Vehicle& v) {
  return v.beat_averaged ? v.beat_averaged->nominal_Hz : v.jointed ? v.jointed->frequency_Hz : v.driver.flapping_Hz;
}

}  // namespace flappy::model
