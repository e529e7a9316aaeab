#include "lab/blind/b/b_robot_parameters.hpp"

#include <cmath>
#include <numbers>

#include "io/config.hpp"
#include "io/sha256.hpp"
#include "lab/blind/b/b_random.hpp"

namespace flappy::blind::b {
namespace {

Vector3d read_vector(const io::Table& t, const std::string& key) {
  return {t.number(key + ".x"), t.number(key + ".y"), t.number(key + ".z")};
}

Link read_link(const io::Table& t, const std::string& key) {
  Link link;
  link.mass_kg = t.number(key + ".mass_kg", io::positive(1));
  link.com_m = read_vector(t, key + ".com_m");
  const std::string inertia = key + ".inertia_kg_m2.";
  const double xy = t.number(inertia + "xy"), yz = t.number(inertia + "yz"), xz = t.number(inertia + "xz");
  link.inertia_kg_m2 << t.number(inertia + "xx", io::positive(1)), xy, xz, xy,
      t.number(inertia + "yy", io::positive(1)), yz, xz, yz, t.number(inertia + "zz", io::positive(1));
  return link;
}

Hinge read_hinge(const io::Table& t, const std::string& key) {
  Hinge hinge;
  hinge.lower_rad = t.number(key + ".lower_rad", {-3, 0});
  hinge.upper_rad = t.number(key + ".upper_rad", {0, 3});
  hinge.damping_Nm_s = t.number(key + ".damping_Nm_s", io::non_negative(1));
  hinge.friction_Nm = t.number(key + ".friction_Nm", io::non_negative(1));
  return hinge;
}

Motor read_motor(const io::Table& t, const std::string& key) {
  Motor motor;
  motor.resistance_ohm = t.number(key + ".resistance_ohm", io::positive(1e4));
  motor.torque_constant_Nm_A = t.number(key + ".torque_constant_Nm_A", io::positive(1));
  motor.gear_ratio = t.number(key + ".gear_ratio", io::positive(1e4));
  motor.efficiency = t.number(key + ".efficiency", io::positive(1));
  motor.friction_Nm = t.number(key + ".friction_Nm", io::non_negative(1));
  motor.damping_Nm_s = t.number(key + ".damping_Nm_s", io::non_negative(1));
  motor.rotor_inertia_kg_m2 = t.number(key + ".rotor_inertia_kg_m2", io::non_negative(1));
  motor.voltage_limit_V = t.number(key + ".voltage_limit_V", io::positive(1e3));
  return motor;
}

Side read_side(const io::Table& t, const std::string& side) {
  Side s;
  s.edge = read_link(t, side + ".leading_edge");
  s.wing = read_link(t, side + ".wing");
  s.shoulder_m = read_vector(t, side + ".shoulder_m");
  s.stroke = read_hinge(t, side + ".stroke");
  s.rotation = read_hinge(t, side + ".rotation");
  s.motor = read_motor(t, side + ".motor");
  s.stiffness_positive_Nm_rad = t.number(side + ".spring.stiffness_positive_Nm_rad", io::non_negative(10));
  s.stiffness_negative_Nm_rad = t.number(side + ".spring.stiffness_negative_Nm_rad", io::non_negative(10));
  s.rest_angle_rad = t.number(side + ".spring.rest_angle_rad", {-1, 1});
  s.wing_length_m = t.number(side + ".planform.wing_length_m", io::positive(10));
  s.mean_chord_m = t.number(side + ".planform.mean_chord_m", io::positive(10));
  return s;
}

/// Random factor with mean 1 and standard deviation `sd`.
double factor(Random& random, double sd) { return 1 + sd * random.normal_within_three(); }

void draw_link(Random& random, Link& link, double inertia_sd) {
  link.mass_kg *= factor(random, 0.03);
  for (double& x : link.com_m) x += 0.3e-3 * random.normal_within_three();
  const Matrix3d declared = link.inertia_kg_m2;
  // A flat wing's inertia is at the limit of what is physical, so about half of the draws are repeated.
  do {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j)
        link.inertia_kg_m2(i, j) = link.inertia_kg_m2(j, i) = declared(i, j) * factor(random, inertia_sd);
  } while (!is_inertia(link.inertia_kg_m2));
}

}  // namespace

double RobotParameters::mass_kg() const {
  double mass = torso.mass_kg;
  for (const Side& s : side) mass += s.edge.mass_kg + s.wing.mass_kg;
  return mass;
}

bool is_inertia(const Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(inertia, Eigen::EigenvaluesOnly);
  const Vector3d& moments = solver.eigenvalues();
  return moments[0] > 0 && moments[2] <= (moments[0] + moments[1]) * (1 + 1e-3);
}

RobotParameters read_parameters(const std::filesystem::path& file) {
  const io::Config config = io::Config::load(file);
  const io::Table t = config.root();
  RobotParameters f;
  f.file = file.filename().string();
  f.sha256 = io::sha256(io::read_text(file));
  f.density_kg_m3 = t.number("air.density_kg_m3", io::positive(10));
  f.flapping_Hz = t.number("driver.flapping_Hz", io::positive(1e3));
  f.hold_s = t.number("driver.hold_s", io::positive(1));
  f.amplitude_limit_V = t.number("driver.amplitude_limit_V", io::positive(1e3));
  f.difference_limit_V = t.number("driver.difference_limit_V", io::positive(1e3));
  f.bias_limit_V = t.number("driver.bias_limit_V", io::positive(1e3));
  f.split_cycle_limit = t.number("driver.split_cycle_limit", {0, 0.49, true});
  f.below_m = t.number("extent.below_m", io::non_negative(10));
  f.above_m = t.number("extent.above_m", io::non_negative(10));
  f.around_m = t.number("extent.around_m", io::non_negative(10));
  f.torso = read_link(t, "torso");
  f.side = {read_side(t, "left"), read_side(t, "right")};
  for (const auto& [link, key] : {std::pair{&f.torso, "torso"},
                                  {&f.side[0].edge, "left.leading_edge"},
                                  {&f.side[0].wing, "left.wing"},
                                  {&f.side[1].edge, "right.leading_edge"},
                                  {&f.side[1].wing, "right.wing"}})
    if (!is_inertia(link->inertia_kg_m2))
      t.table(key).fail("inertia_kg_m2", "no body has this inertia",
                        "positive principal moments, none above the sum of the others");
  return f;
}

// The shipped vehicle; a test compares it with its file.
RobotParameters nominal_parameters() {
  RobotParameters f;
  f.density_kg_m3 = 1.18009482370369;
  f.flapping_Hz = 34;
  f.hold_s = 1e-3;
  f.amplitude_limit_V = 18, f.difference_limit_V = 3, f.bias_limit_V = 3.5, f.split_cycle_limit = 0.15;
  f.below_m = 0, f.above_m = 18.9913e-3, f.around_m = 0.084;
  const auto inertia = [](double xx, double yy, double zz, double xy, double yz, double xz) {
    Matrix3d m;
    m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return Matrix3d(1e-9 * m);
  };
  f.torso = {10.9067e-3,
             {0.1797e-3, 0.0008e-3, -1.3998e-3},
             inertia(4238.1285, 3970.1646, 2440.9505, -76.8896, 0.3011, 16.55)};
  for (std::size_t j = 0; j < 2; ++j) {
    Side& s = f.side[j];
    const double sign = j == 0 ? 1 : -1;
    s.edge = {0.7081e-3,
              {-0.2837e-3, sign * 3.3023e-3, -6.3984e-3},
              inertia(132.8411, 47.7258, 90.6904, -sign * 0.0416, sign * 12.5149, -0.4990)};
    s.wing = {0.0626e-3,
              {sign * 0.0024e-3, sign * 37.3242e-3, -9.8917e-3},
              inertia(21.4402, 2.2204, 19.2209, 0, sign * 0.1968, -sign * 0.0001)};
    s.shoulder_m = {0, sign * 13.95e-3, 18.9913e-3};
    s.stroke = {-1.63, 1.63, 8e-9, 1e-9};
    s.rotation = {-0.7854, 0.7854, 1e-9, 1e-8};
    s.motor = {12.4, 1.75e-3, 10, 0.9, 2e-5, 9.74e-9, 7.03e-10, 18};
    s.stiffness_positive_Nm_rad = s.stiffness_negative_Nm_rad = 0.013384289;
    s.wing_length_m = 0.07, s.mean_chord_m = 0.021212121212121;
  }
  return f;
}

void draw_parameters(std::uint64_t seed, RobotParameters& parameters) {
  Random random(seed, 0, Stream::kParameters);
  draw_link(random, parameters.torso, 0.07);
  parameters.density_kg_m3 *= factor(random, 0.02);  // weather, in addition to the coefficients of each wing
  for (Side& s : parameters.side) {
    draw_link(random, s.edge, 0.07);
    draw_link(random, s.wing, 0.07);
    for (double& x : s.shoulder_m) x += 0.3e-3 * random.normal_within_three();
    for (Hinge* hinge : {&s.stroke, &s.rotation}) {
      hinge->lower_rad += 2 * kDegree * random.normal_within_three();
      hinge->upper_rad += 2 * kDegree * random.normal_within_three();
      hinge->damping_Nm_s *= factor(random, 0.3);
      hinge->friction_Nm *= factor(random, 0.3);
    }
    s.motor.resistance_ohm *= factor(random, 0.07);
    s.motor.torque_constant_Nm_A *= factor(random, 0.03);
    s.motor.friction_Nm *= factor(random, 0.3);
    s.motor.damping_Nm_s *= factor(random, 0.3);
    s.motor.rotor_inertia_kg_m2 *= factor(random, 0.07);
    s.stiffness_positive_Nm_rad *= factor(random, 0.05);
    s.stiffness_negative_Nm_rad *= factor(random, 0.05);
    s.rest_angle_rad += kDegree * random.normal_within_three();
    s.lift *= factor(random, 0.05);
    s.drag *= factor(random, 0.05);
    s.turning_drag *= factor(random, 0.05);
  }
}

}  // namespace flappy::blind::b
