// The blade element against the paper's own form: arc tangent, sign and multiple angles.
#include "model/wing_aerodynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "model/derive.hpp"
#include "model/wing_angles.hpp"
#include "vehicles.hpp"

namespace flappy {
namespace {

using std::numbers::pi;

double paper_force(double a) {
  return 1.8 * std::sin(2 * a) * std::cos(a) + 1.95 * std::sin(a) - 1.5 * std::cos(2 * a) * std::sin(a);
}
double paper_pressure_centre(double a) {
  return 0.46 - 0.332 * std::cos(a) - 0.037 * std::cos(3 * a) - 0.013 * std::cos(5 * a);
}

TEST(WingAerodynamics, CoefficientsAreThoseOfThePaper) {
  for (double a = -2 * pi; a <= 2 * pi; a += 0.01) {
    const auto c = model::coefficients(std::sin(a), std::cos(a));
    EXPECT_NEAR(c.force, paper_force(a), 1e-14) << a;
    EXPECT_NEAR(c.pressure_centre, paper_pressure_centre(a), 1e-14) << a;
  }
  // by hand: C_N(90 deg) = 1.95 + 1.5, d_cp(0) = 0.078, d_cp(90 deg) = 0.46, d_cp(180 deg) = 0.842
  EXPECT_DOUBLE_EQ(model::coefficients(1.0, 0.0).force, 3.45);
  EXPECT_NEAR(model::coefficients(0.0, 1.0).pressure_centre, 0.078, 1e-15);
  EXPECT_DOUBLE_EQ(model::coefficients(1.0, 0.0).pressure_centre, 0.46);
  EXPECT_NEAR(model::coefficients(0.0, -1.0).pressure_centre, 0.842, 1e-15);
}

/// The paper's equations for one wing of the robot, Phi = phi = 0; body rates p, q, r and velocity u, v, w of
/// the point from which d_s is measured.
struct PaperWing {
  double normal_force, moment_y;  // F_N, M_aero + M_rd
};
PaperWing paper_wing(const model::Side& s, double rho, int sg, double psi, double psi_rate, double theta,
                     double theta_rate, const double (&velocity)[3], const double (&rate)[3]) {
  const auto [p, q, r] = rate;
  const auto [u, v, w] = velocity;
  const double d_0 = std::abs(s.shoulder_m.y), d_s = s.shoulder_m.z;
  const double ui1 = psi_rate + sg * r;
  const double ui0 = sg * (r * d_0 * std::cos(psi) - (v - p * d_s) * std::sin(psi)) - (u + q * d_s) * std::cos(psi);
  const double uo1 = sg * p * std::cos(psi) + q * std::sin(psi);
  const double uo0 = sg * p * d_0 + w;
  const model::Planform& f = s.planform;
  const double R = f.wing_length_m, c = f.mean_chord_m, r_cp = R * f.r33 / f.r22;
  const double ui = ui1 * r_cp + ui0, uo = uo1 * r_cp + uo0;
  const double alpha = theta + (ui > 0 ? pi / 2 : -pi / 2) - std::atan(uo / ui);
  const double a2 = ui1 * ui1 + uo1 * uo1, a1 = 2 * (ui1 * ui0 + uo1 * uo0), a0 = ui0 * ui0 + uo0 * uo0;
  const double force =
      0.5 * rho * paper_force(alpha) * c * (a2 * R * R * R * f.r22 + a1 * R * R * f.r11 + a0 * R * f.r00);
  const double aero = -0.5 * rho * c * c * paper_force(alpha) * paper_pressure_centre(alpha) *
                      (a2 * R * R * R * f.z_cp2 + a1 * R * R * f.z_cp1 + a0 * R * f.z_cp0);
  const double damping =
      -0.125 * rho * std::abs(theta_rate) * theta_rate * f.rotational_damping_coefficient * R * std::pow(c, 4) * f.z_rd;
  return {force, aero + damping};
}

template <int side>
void compare_with_paper(const model::Vehicle& vehicle) {
  const model::Side& s = side > 0 ? vehicle.left : vehicle.right;
  const auto parameters = model::derive(vehicle, 1e-4);
  const auto& p = side > 0 ? parameters.left : parameters.right;
  std::mt19937_64 engine(3);
  const auto random = [&](double scale) { return scale * std::uniform_real_distribution<double>(-1, 1)(engine); };
  for (int trial = 0; trial < 500; ++trial) {
    const double psi = random(1.2), psi_rate = random(300), theta = random(0.8), theta_rate = random(400);
    const double velocity[3] = {random(2), random(2), random(2)}, rate[3] = {random(30), random(30), random(30)};
    const PaperWing expected =
        paper_wing(s, vehicle.air_density_kg_m3, side, psi, psi_rate, theta, theta_rate, velocity, rate);

    using V = model::Vec3<double>;
    const V w_B{rate[0], rate[1], rate[2]};
    const V shoulder_velocity = V{velocity[0], velocity[1], velocity[2]} + model::cross(w_B, p.shoulder_m);
    const double sb = std::sin(side * psi), cb = std::cos(side * psi);
    V w_L = model::rotate_back_z(sb, cb, w_B);
    w_L.z += side * psi_rate;
    const auto wrench = model::blade_element<side>(p, {std::sin(theta), std::cos(theta)}, theta_rate,
                                                   model::rotate_back_z(sb, cb, shoulder_velocity), w_L);
    const double r_cp = p.span_to_pressure_m;
    EXPECT_NEAR(wrench.normal_force_N, expected.normal_force, 1e-12);
    EXPECT_NEAR(wrench.moment_Nm.y, expected.moment_y, 1e-13);
    // F_N along x of the wing at (0, s r_cp, .): in E, force (F cos, 0, -F sin), moment about z -s r_cp F
    // cos(theta)
    EXPECT_NEAR(wrench.force_x_N, expected.normal_force * std::cos(theta), 1e-12);
    EXPECT_NEAR(wrench.force_z_N, -expected.normal_force * std::sin(theta), 1e-12);
    EXPECT_NEAR(wrench.moment_Nm.z, -side * r_cp * expected.normal_force * std::cos(theta), 1e-13);
    EXPECT_NEAR(wrench.moment_Nm.x, -side * r_cp * expected.normal_force * std::sin(theta), 1e-13);
  }
}

TEST(WingAerodynamics, LeftWingIsThatOfThePaper) { compare_with_paper<+1>(test::nominal()); }
TEST(WingAerodynamics, RightWingIsThatOfThePaper) { compare_with_paper<-1>(test::nominal()); }

TEST(WingAerodynamics, StillAirDoesNothing) {
  const auto p = model::derive(test::nominal(), 1e-4);
  const auto wrench = model::blade_element<+1>(p.left, {0.1, std::sqrt(0.99)}, 0.0, {0, 0, 0}, {0, 0, 0});
  EXPECT_EQ(wrench.normal_force_N, 0);
  EXPECT_EQ(wrench.moment_Nm.y, 0);
}

TEST(WingAerodynamics, AirTakesEnergyFromAWingInStillAir) {
  // any motion of the hinges alone: the power of the air is never positive
  const auto p = model::derive(test::nominal(), 1e-4);
  for (double theta = -0.7; theta < 0.75; theta += 0.1)
    for (const double rate : {-200.0, -1.0, 1.0, 200.0}) {
      const auto wrench =
          model::blade_element<+1>(p.left, {std::sin(theta), std::cos(theta)}, 0.0, {0, 0, 0}, {0, 0, rate});
      EXPECT_LT(wrench.moment_Nm.z * rate, 0) << theta << " " << rate;
    }
}

// ---- four driven angles

using V = model::Vec3<double>;
using Angles = model::WingAngles<double>;

/// A direction of E, in B, by the published angles: R_y(-s Phi) R_z(s psi) R_x(s phi).
template <int side>
V leading_edge_direction(const Angles& a, const V& in_E) {
  const auto about = [](double angle, int axis, V v) {
    const double s = std::sin(angle), c = std::cos(angle);
    if (axis == 0) return V{v.x, c * v.y - s * v.z, s * v.y + c * v.z};
    if (axis == 1) return V{c * v.x + s * v.z, v.y, -s * v.x + c * v.z};
    return V{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
  };
  return about(-side * a.stroke_plane_rad, 1, about(side * a.stroke_rad, 2, about(side * a.deviation_rad, 0, in_E)));
}

Angles plus(const Angles& a, double h, const Angles& r) {
  return {a.stroke_plane_rad + h * r.stroke_plane_rad, a.stroke_rad + h * r.stroke_rad,
          a.deviation_rad + h * r.deviation_rad, a.rotation_rad + h * r.rotation_rad};
}

template <int side>
void drive_four_angles() {
  const auto parameters = model::derive(test::nominal(), 1e-4);
  const auto& p = side > 0 ? parameters.left : parameters.right;
  std::mt19937_64 engine(5);
  const auto random = [&](double scale) { return scale * std::uniform_real_distribution<double>(-1, 1)(engine); };
  for (int trial = 0; trial < 200; ++trial) {
    const Angles angles{random(0.5), random(1.2), random(0.4), random(0.8)};
    const Angles rates{random(50), random(300), random(100), random(300)};
    const V velocity{random(2), random(2), random(2)}, body_rate{random(30), random(30), random(30)};
    const auto ours = model::air_on_driven_wing<side>(p, angles, rates, velocity, body_rate);

    // velocity of the leading edge at span r by central differences: 1e-6 s leaves 1e-9 of rounding and of
    // curvature
    const double h = 1e-6;
    const auto velocity_at = [&](double r) {
      const V out = leading_edge_direction<side>(plus(angles, h, rates), {0, side * r, 0});
      const V in = leading_edge_direction<side>(plus(angles, -h, rates), {0, side * r, 0});
      const V here = leading_edge_direction<side>(angles, {0, side * r, 0});
      return velocity + (model::cross(body_rate, here) + (0.5 / h) * (out - in));
    };
    const V x = leading_edge_direction<side>(angles, {1, 0, 0}), z = leading_edge_direction<side>(angles, {0, 0, 1});
    const auto in_plane = [&](double r) { return -model::dot(velocity_at(r), x); };
    const auto out_of_plane = [&](double r) { return model::dot(velocity_at(r), z); };
    const double ui0 = in_plane(0), ui1 = in_plane(1) - ui0, uo0 = out_of_plane(0), uo1 = out_of_plane(1) - uo0;
    const double r_cp = p.span_to_pressure_m, ui = ui1 * r_cp + ui0, uo = uo1 * r_cp + uo0;
    const double alpha = angles.rotation_rad + (ui > 0 ? pi / 2 : -pi / 2) - std::atan(uo / ui);
    const double force = paper_force(alpha) * ((ui1 * ui1 + uo1 * uo1) * p.force2 + (ui1 * ui0 + uo1 * uo0) * p.force1 +
                                               (ui0 * ui0 + uo0 * uo0) * p.force0);
    const V normal = std::cos(angles.rotation_rad) * x - std::sin(angles.rotation_rad) * z;  // x of the wing
    EXPECT_NEAR(ours.force_N.x, force * normal.x, 1e-6 * std::abs(force) + 1e-9);
    EXPECT_NEAR(ours.force_N.y, force * normal.y, 1e-6 * std::abs(force) + 1e-9);
    EXPECT_NEAR(ours.force_N.z, force * normal.z, 1e-6 * std::abs(force) + 1e-9);
    // the moment about the wing's own z is F_N at r_cp
    const V wing_z = std::sin(angles.rotation_rad) * x + std::cos(angles.rotation_rad) * z;
    EXPECT_NEAR(model::dot(ours.moment_Nm, wing_z), -side * r_cp * force, 1e-7 * std::abs(force) + 1e-10);
  }
}

TEST(WingAngles, FourDrivenAnglesOnTheLeft) { drive_four_angles<+1>(); }
TEST(WingAngles, FourDrivenAnglesOnTheRight) { drive_four_angles<-1>(); }

// A quarter turn of the stroke plane stands each wing's forward axis on its end: up on the left, down on the right. The same
// stroke moves the wing against that axis, so the air lifts the left wing and presses the right one down.
TEST(WingAngles, StrokePlanesOfOneAngleTiltOppositely) {
  const auto p = model::derive(test::nominal(), 1e-4);
  const V still{0, 0, 0};
  const double force = 3.45 * 1e4 * p.left.force2;  // C_N(90 deg) at 100 rad/s
  const auto lift = [&](const Angles& angles, const Angles& rates) {
    const double left = model::air_on_driven_wing<+1>(p.left, angles, rates, still, still).force_N.z;
    EXPECT_NEAR(model::air_on_driven_wing<-1>(p.right, angles, rates, still, still).force_N.z, -left, 1e-12 * force);
    return left;
  };
  EXPECT_NEAR(lift({pi / 2, 0, 0, 0}, {0, 100, 0, 0}), force, 1e-12 * force);
  // wings swept aft and turned flat, whose stroke planes tilt: the left one goes down
  EXPECT_NEAR(lift({0, pi / 2, 0, pi / 2}, {100, 0, 0, 0}), force, 1e-12 * force);
}

TEST(WingAngles, RobotIsTheCaseWithoutOffsetAndDeviation) {
  const auto p = model::derive(test::nominal(), 1e-4).right;
  const V v{0.5, -0.3, 0.2}, w{3, -7, 5};
  const auto driven = model::air_on_driven_wing<-1>(p, Angles{0, 0.6, 0, -0.4}, Angles{0, 200, 0, 90}, v, w);
  const double s = std::sin(-0.6), c = std::cos(-0.6);
  V w_E = model::rotate_back_z(s, c, w);
  w_E.z -= 200;
  const auto robot =
      model::blade_element<-1>(p, {std::sin(-0.4), std::cos(-0.4)}, 90.0, model::rotate_back_z(s, c, v), w_E);
  const V force = model::rotate_z(s, c, robot.force_x_N, robot.force_z_N);
  EXPECT_NEAR(driven.force_N.x, force.x, 1e-15);
  EXPECT_NEAR(driven.force_N.y, force.y, 1e-15);
  EXPECT_NEAR(driven.force_N.z, force.z, 1e-15);
}

}  // namespace
}  // namespace flappy
