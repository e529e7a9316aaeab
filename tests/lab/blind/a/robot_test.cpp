// The blind robot without anything wrong: against other engines (tests/data/trajectories) and against what mechanics says.
#include <gtest/gtest.h>

#include <functional>

#include "io/csv.hpp"
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

// MuJoCo at 10 us with its soft stops. The strips see their own angle of attack, not that at the centre of pressure, and
// their moments are within 1e-3 of the published; both are below 1 %.
TEST(BlindRobot, LiftsAsOtherEnginesSay) {
  const std::pair<double, double> thrust[] = {
      {6, 0.052777}, {8, 0.087992}, {10, 0.126087}, {12, 0.166247}, {14, 0.207997}};
  for (const auto& [volts, newton] : thrust) {
    const Stand s = on_stand({.amplitude_V = volts});
    EXPECT_NEAR(s.force_N.z(), newton, 0.01 * newton) << volts << " V";
    if (volts == 10) EXPECT_NEAR(s.amplitude_rad * 180 / kPi, 65.97, 0.2);
  }
}

// A step half as long changes thrust by 1e-4: the error of the step is far below that of the strips.
TEST(BlindRobot, StepIsShortEnough) {
  const double coarse = on_stand({}).force_N.z(), fine = on_stand({}, kRobotStep_s / 2).force_N.z();
  EXPECT_NEAR(coarse, fine, 5e-4 * fine);
}

// DART at 20 us. Its wings rest on hard stops, and it measures shoulders from the torso's centre of mass.
TEST(BlindRobot, TurnsAsOtherEnginesSay) {
  const Vector3d rest = on_stand({}).moment_Nm;
  const Vector3d roll = on_stand({.difference_V = 1}).moment_Nm - rest,
                 pitch = on_stand({.bias_V = 1}).moment_Nm - rest,
                 yaw = on_stand({.split_cycle = 0.1}).moment_Nm - rest;
  EXPECT_NEAR(roll.x(), 1.053e-3, 0.03e-3);
  EXPECT_NEAR(pitch.y(), 0.579e-3, 0.02e-3);
  EXPECT_NEAR(yaw.z(), 3.85e-4, 0.15e-4);
}

// MuJoCo's flight takes the air's velocity 1.4 mm off and has softer stops; another exact engine is within 5.7 mm of it.
TEST(BlindRobot, FliesAsMuJoCoDoes) {
  const io::CsvTable table = io::read_csv(test::source_path("tests/data/trajectories/free_10V_mujoco.csv"));
  const auto at = [&](const char* name, std::size_t row) { return table.column(name)[row]; };
  Robot robot(test::nominal(), {.ground_z_m = -9}, {}, 1);
  double t = 0, farthest = 0, turned = 0, stroke = 0;
  for (std::size_t row = 1; row < table.column("t_s").size(); ++row) {
    run(robot, {}, t, at("t_s", row));
    t = at("t_s", row);
    const Torso& torso = robot.torso();
    const Vector3d com = torso.position_m + torso.attitude * Vector3d(0.1797e-3, 0.0008e-3, -1.3998e-3);
    const Vector3d theirs(at("torso_com_x_m", row), at("torso_com_y_m", row), at("torso_com_z_m", row));
    farthest = std::max(farthest, (com - theirs).norm());
    const Quaterniond q(at("qw", row), at("qx", row), at("qy", row), at("qz", row));
    turned = std::max(turned, q.angularDistance(torso.attitude));
    stroke = std::max(stroke, std::abs(robot.wing(0).stroke_rad - at("left_stroke_rad", row)));
  }
  EXPECT_GT(t, 0.29);
  EXPECT_LT(farthest, 6e-3);
  EXPECT_LT(turned, 0.08);
  EXPECT_LT(stroke, 0.05);
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
    EXPECT_EQ(robot.state().side[k].winding_K, before.side[k].winding_K);
    EXPECT_GT(robot.state().side[k].winding_K, 0);
  }
  EXPECT_EQ(robot.battery_V(), before.battery_V);
}

TEST(BlindMaths, AgreesWithLibm) {
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
