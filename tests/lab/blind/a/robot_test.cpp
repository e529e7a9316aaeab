// The blind robot without anything wrong: against theory and against what mechanics says.
#include <gtest/gtest.h>

#include <functional>

#include "lab/blind/a/a_robot.hpp"
#include "vehicles.hpp"

namespace flappy::blind::robot_test {
namespace {

constexpr double kFlapping_Hz = 34;

/// Of the nominal vehicle, by voltages that are refreshed each millisecond.
struct Drive {
  double amplitude_V = 10, difference_V = 0, bias_V = 0, split_cycle = 0;
  double volts(double t_s, std::size_t side) const {
    const double sign = side == 0 ? 1 : -1, beat = t_s * kFlapping_Hz, t = beat - std::floor(beat);
    const double s = 0.5 - sign * split_cycle, a = amplitude_V + sign * difference_V;
    return (t < s ? a * std::cos(kPi * t / s) : a * std::cos(kPi * (t - 1) / (1 - s))) + bias_V;
  }
};

void run(
    Robot& robot, const Drive& drive, double begin_s, double end_s, const std::function<void()>& each = [] {}) {
  const std::int64_t hold = std::lround(1e-3 / robot.step_s());
  double volts[2] = {0, 0};
  for (std::int64_t n = std::lround(begin_s / robot.step_s()); n < std::lround(end_s / robot.step_s()); ++n) {
    if (n % hold == 0)
      for (const std::size_t side : {0u, 1u}) volts[side] = drive.volts(static_cast<double>(n) * robot.step_s(), side);
    robot.step(volts[0], volts[1]);
    each();
  }
}

struct Stand {
  Vector3d force_N = Vector3d::Zero(), moment_Nm = Vector3d::Zero();  ///< mean, moment about the vehicle's middle
  double amplitude_rad = 0;
};
Stand on_stand(const Drive& drive, double step_s = kRobotStep_s) {
  Robot robot(test::nominal(), {}, {}, 1, 0, step_s);
  robot.hold_torso(true);
  run(robot, drive, 0, 0.5);
  Stand s;
  double steps = 0, high = -9, low = 9;
  run(robot, drive, 0.5, 1.0, [&] {  // 17 beats
    s.force_N += robot.air().force_N;
    s.moment_Nm += robot.air().moment_Nm;
    high = std::max(high, robot.wing(0).stroke_rad), low = std::min(low, robot.wing(0).stroke_rad);
    ++steps;
  });
  s.force_N /= steps;
  // centre of mass of the vehicle with level wings: bodies' masses and centres of hummingbird_nominal.toml
  const Vector3d com(0.000125, 0, -0.00004);
  s.moment_Nm = s.moment_Nm / steps - com.cross(s.force_N);
  s.amplitude_rad = (high - low) / 2;
  return s;
}

// Thrust of wings at rest in the air that move as these did, from the planform's second moment: on each wing
// 1/2 rho C_N c R^3 r22 psidot |psidot| cos(theta), of which -sin(theta) is lift, and friction's lift is 0. Strips give the
// moment to 2e-3.
TEST(BlindRobot, LiftsAsItsTheorySays) {
  const model::Vehicle v = test::nominal();
  const model::Planform& p = v.left.planform;
  Robot robot(v, {}, {}, 1);
  robot.hold_torso(true);
  run(robot, {}, 0, 0.5);
  double lift_N = 0, theory_N = 0;
  Wing before = robot.wing(0);
  run(robot, {}, 0.5, 1.0, [&] {
    const double head = 0.5 * v.air_density_kg_m3 * p.mean_chord_m * std::pow(p.wing_length_m, 3) * p.r22;
    theory_N -= 2 * head * wing_section(1, 0).normal * before.stroke_rad_s * std::abs(before.stroke_rad_s) *
                std::cos(before.rotation_rad) * std::sin(before.rotation_rad);
    lift_N += robot.air().force_N.z();
    before = robot.wing(0);
  });
  EXPECT_NEAR(lift_N / theory_N, 1, 3e-3);
}

// It hovers within 1 V of the voltage that the vehicle's laboratory states, 9.8 V; MuJoCo and the product's force law
// lift 0.1261 N at 10 V with a stroke of 66 degrees.
TEST(BlindRobot, HoversAtItsVoltage) {
  const double weight_N = Robot(test::nominal(), {}, {}, 1).mass_kg() * 9.81;
  EXPECT_LT(on_stand({.amplitude_V = 8.8}).force_N.z(), weight_N);
  EXPECT_GT(on_stand({.amplitude_V = 10.8}).force_N.z(), weight_N);
  const Stand s = on_stand({});
  EXPECT_NEAR(s.force_N.z(), 0.126, 0.006);
  EXPECT_NEAR(s.amplitude_rad * 180 / kPi, 66, 3);
}

// The wing's force grows as sin(alpha), with its lift as sin(2 alpha), and lies where Dickson et al. say.
TEST(BlindRobot, HasTheSectionOfItsTheory) {
  const double root = std::sqrt(0.5);
  EXPECT_NEAR(wing_section(root, root).normal / wing_section(1, 0).normal, root, 1e-12);
  EXPECT_NEAR(wing_section(root, root).centre, 0.82 / 4 + 0.05, 1e-12);
  EXPECT_NEAR(wing_section(root, -root).centre, 0.82 * 0.75 + 0.05, 1e-12);
  EXPECT_NEAR(wing_section(-1, 0).normal, -wing_section(1, 0).normal, 1e-12);
  // without translation, the drag of a plate that turns about its edge: C c^4 / 4
  EXPECT_NEAR(rotation_drag(0.02, 0, 50) / rotation_drag(0.02, 0, 25), 4, 1e-9);
  EXPECT_NEAR(rotation_drag(0.02, 0, 50), -0.234 * std::pow(0.02, 4) / 4 * 2500, 1e-9);
}

// A step half as long changes thrust by 1e-4: the error of the step is far below that of the strips.
TEST(BlindRobot, StepIsShortEnough) {
  const double coarse = on_stand({}).force_N.z(), fine = on_stand({}, kRobotStep_s / 2).force_N.z();
  EXPECT_NEAR(coarse, fine, 5e-4 * fine);
}

// As the pilot believes (robot_controller.cpp); other engines with the product's force law are within 8 %.
TEST(BlindRobot, TurnsAsItsPilotBelieves) {
  const Vector3d rest = on_stand({}).moment_Nm;
  const Vector3d roll = on_stand({.difference_V = 1}).moment_Nm - rest,
                 pitch = on_stand({.bias_V = 1}).moment_Nm - rest,
                 yaw = on_stand({.split_cycle = 0.1}).moment_Nm - rest;
  EXPECT_NEAR(roll.x(), 9.72e-4, 0.3e-4);
  EXPECT_NEAR(pitch.y(), 5.41e-4, 0.2e-4);
  EXPECT_NEAR(yaw.z(), 3.67e-4, 0.15e-4);
}

/// In space: no air, no weight, no drive, wings that swing freely; turning and moving.
model::Vehicle free_vehicle() {
  model::Vehicle v = test::identified();
  v.air_density_kg_m3 = 0;
  for (model::Side* s : {&v.left, &v.right}) {
    s->motor.efficiency = 0;  // the motor lets go
    s->stroke.damping_Nm_s = s->stroke.friction_Nm = s->rotation.damping_Nm_s = s->rotation.friction_Nm = 0;
    s->rotation.lower_rad = -50, s->rotation.upper_rad = 50;
  }
  return v;
}
Robot in_space(double step_s) {
  Robot robot(free_vehicle(), {.gravity_m_s2 = 0}, {}, 1, 0, step_s);
  RobotState x = robot.state();
  x.torso.velocity_m_s = {0.4, -0.7, 0.3};
  x.torso.rate_rad_s = {3, -5, 4};
  x.side[0].wing = {0.7, 0.4, -50, 80};
  x.side[1].wing = {-0.3, -0.5, 90, 40};
  robot.set_state(x);
  return robot;
}
struct Drift {
  double linear, angular, energy;  // relative
};
Drift drift_in_space(double step_s) {
  Robot robot = in_space(step_s);
  const auto before = robot.momentum();
  Drift worst{};
  for (int i = 0; i < 20; ++i) {
    run(robot, {.amplitude_V = 0}, 0.005 * i, 0.005 * (i + 1));
    const auto now = robot.momentum();
    worst.linear = std::max(worst.linear, (now.linear_kg_m_s - before.linear_kg_m_s).norm());
    worst.angular = std::max(worst.angular, (now.angular_kg_m2_s - before.angular_kg_m2_s).norm());
    worst.energy = std::max(worst.energy, std::abs(now.energy_J - before.energy_J));
  }
  return {worst.linear / before.linear_kg_m_s.norm(), worst.angular / before.angular_kg_m2_s.norm(),
          worst.energy / before.energy_J};
}

// The method is of first order: what it loses halves with the step. A wrong term would stay.
TEST(BlindRobot, ConservesMomentumAndEnergy) {
  const Drift coarse = drift_in_space(2e-5), fine = drift_in_space(2.5e-6);
  EXPECT_LT(coarse.linear, 2e-3);
  EXPECT_LT(coarse.angular, 2e-2);
  EXPECT_LT(coarse.energy, 2e-2);
  for (const auto drift : {&Drift::linear, &Drift::angular, &Drift::energy})
    EXPECT_NEAR(fine.*drift / coarse.*drift, 1.0 / 8, 0.05);
}

// In free fall nothing is felt; on a stand, the weight.
TEST(BlindRobot, FeelsSpecificForce) {
  model::Vehicle v = free_vehicle();
  v.left.spring.rest_angle_rad = v.right.spring.rest_angle_rad = 0;
  Robot robot(v, {}, {}, 1);
  robot.step(0, 0);
  const Vector3d at(0.01, -0.02, 0.005);
  EXPECT_LT(robot.specific_force(at).norm(), 1e-9);
  robot.hold_torso(true);
  robot.place_torso({});
  robot.step(0, 0);
  EXPECT_LT((robot.specific_force(at) - Vector3d(0, 0, 9.81)).norm(), 1e-9);
}

// Of a point that turns with the body: the change of its velocity. First order in a step of 2 us, at 50 m/s^2 and 5 rad/s
// and jerks of some 1e4 m/s^3.
TEST(BlindRobot, FeelsThePointTurn) {
  Robot robot = in_space(2e-6);
  const Vector3d at(0.3, -0.2, 0.5);
  const auto velocity = [&] {
    const Torso& t = robot.torso();
    return Vector3d(t.velocity_m_s + t.attitude * t.rate_rad_s.cross(at));
  };
  const Vector3d before = velocity();
  const Quaterniond attitude = robot.torso().attitude;
  robot.step(0, 0);
  const Vector3d felt = attitude.conjugate() * ((velocity() - before) / 2e-6);
  EXPECT_GT(felt.norm(), 10);
  EXPECT_LT((robot.specific_force(at) - felt).norm(), 0.1);
}

TEST(BlindRobot, CarriedTorsoKeepsWingsAndSlowStates) {
  Robot robot(test::nominal(), {}, Magnitudes({{"winding_heating", 1}, {"battery_sag", 1}}), 1);
  run(robot, {}, 0, 0.2);
  const RobotState before = robot.state();
  Torso torso{{0.1, 0.2, 0.3}, turned_by({0.1, 0, 0.2}), {1, 0, 0}, {0, 0, 2}};
  robot.place_torso(torso);
  EXPECT_EQ(robot.torso().position_m, torso.position_m);
  EXPECT_EQ(robot.torso().rate_rad_s, torso.rate_rad_s);
  for (const std::size_t k : {0u, 1u}) {
    EXPECT_EQ(robot.wing(k).stroke_rad, before.side[k].wing.stroke_rad);
    EXPECT_EQ(robot.wing(k).rotation_rad_s, before.side[k].wing.rotation_rad_s);
    EXPECT_EQ(robot.state().side[k].heat.winding_K, before.side[k].heat.winding_K);
    EXPECT_GT(robot.state().side[k].heat.winding_K, 0);
  }
  EXPECT_EQ(robot.battery_V(), before.battery_V);
}

// The leaf of the hardening spring stores k a^2 (-e^2/2 - e - ln(1 - e)) more. It is released at 1.3 rad without any friction
// and swings through.
TEST(BlindRobot, KeepsTheEnergyOfItsHardSpring) {
  model::Vehicle v = free_vehicle();
  v.right.spring.stiffness_positive_Nm_rad = v.right.spring.stiffness_negative_Nm_rad = 0;
  Robot robot(v, {.gravity_m_s2 = 0}, Magnitudes({{"spring_hardening", 1}}), 1, 0, 2e-6);
  RobotState x = robot.state();
  x.side[0].wing.stroke_rad = 1.3;
  robot.set_state(x);
  const auto energy = [&] {
    const double e = std::abs(robot.wing(0).stroke_rad - v.left.spring.rest_angle_rad) / laws::kLeaf_rad - 1;
    const double k = v.left.spring.stiffness_positive_Nm_rad * laws::square(laws::kLeaf_rad);
    return robot.momentum().energy_J + (e > 0 ? k * (-e * e / 2 - e - std::log(1 - e)) : 0);
  };
  const double before = energy();
  double least = 9;
  for (int i = 0; i < 40; ++i) {
    run(robot, {.amplitude_V = 0}, 1e-3 * i, 1e-3 * (i + 1));
    least = std::min(least, robot.wing(0).stroke_rad);
    EXPECT_NEAR(energy() / before, 1, 5e-3) << i;
  }
  EXPECT_LT(least, -1.1);
}

TEST(BlindMaths, AgreesWithLibm) {
  for (double a = 0; a < kPi; a += 0.00137) EXPECT_NEAR(angle_of(std::sin(a), std::cos(a)), a, 1e-13);
  for (double x = -30; x < 30; x += 0.0137) {
    EXPECT_NEAR(sin_cos(x).sin, std::sin(x), 1e-13);
    EXPECT_NEAR(sin_cos(x).cos, std::cos(x), 1e-13);
    EXPECT_NEAR(exponential(x) / std::exp(x), 1, 1e-13);
    EXPECT_NEAR(hyperbolic_tangent(x), std::tanh(x), 1e-13);
    if (x > 0) EXPECT_NEAR(logarithm(x), std::log(x), 1e-13);
  }
}

// The published moments are those of 16 strips to 2e-3: (1/16)^2 / 12 for a mean of squares, and the fit.
TEST(BlindPlanform, HasThePublishedMoments) {
  const model::Planform p = test::nominal().left.planform;
  const Strips s = cut_into_strips(p);
  double sum[8] = {};
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double c = s.chord_m[i] / p.mean_chord_m, x = s.r_m[i] / p.wing_length_m, w = s.width_m / p.wing_length_m;
    for (int k = 0; k < 4; ++k) sum[k] += w * c * std::pow(x, k);
    for (int k = 0; k < 3; ++k) sum[4 + k] += w * c * c * std::pow(x, k);
    sum[7] += w * c * c * c * c;
  }
  const double wanted[8] = {p.r00, p.r11, p.r22, p.r33, p.z_cp0, p.z_cp1, p.z_cp2, p.z_rd};
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(sum[k] / wanted[k], 1, 2e-3) << k;
}

}  // namespace
}  // namespace flappy::blind::robot_test
