#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/b_sensors.hpp"
#include "lab/blind/b/family_b_tests.hpp"

namespace flappy::blind::b {
namespace {

/// A robot without motors, friction and air, thrown with everything moving.
Robot thrown(double gravity, const Effects& effects = {}) {
  RobotParameters f = nominal();
  for (Side& s : f.side) s.motor.torque_constant_Nm_A = 0;
  Surroundings room = open_air();
  room.gravity_m_s2 = gravity;
  Robot robot(f, effect_magnitudes_of(effects, 3), room, 1, 0);
  robot.plant().has_air = robot.plant().has_friction = false;
  robot.put({0, 0, 0}, 0.7);  // at the origin, where the torso's turning is much of the moment of momentum
  State& x = robot.state();
  const std::array<double, 3> rate = {6, -4, 8}, velocity = {0.5, -0.3, 0.8};
  for (std::size_t k = 0; k < 3; ++k) x[kRate + k] = rate[k], x[kVelocity + k] = velocity[k];
  x[kStroke] = 0.15, x[kStroke + 1] = -0.1, x[kStrokeRate] = 30, x[kStrokeRate + 1] = 45;
  x[kRotation] = 0.1, x[kRotationRate] = 12, x[kRotationRate + 1] = -20;
  return robot;
}

TEST(FamilyBBodies, KeepEnergyWithoutAirAndFriction) {
  Robot robot = thrown(kGravity_m_s2);
  const double before = robot.plant().energy_J(robot.state(), robot.room());
  robot.drive({0, 0});
  for (int step = 0; step < 120; ++step) {
    robot.step();
    for (std::size_t j = 0; j < 2; ++j)
      ASSERT_LT(std::abs(robot.state()[kRotation + j]), 0.78) << "a stop would take energy";
  }
  EXPECT_NEAR(robot.plant().energy_J(robot.state(), robot.room()), before, 1e-9 * before);
  EXPECT_GT(std::abs(robot.state()[kStroke] - 0.15), 0.02) << "energy has been exchanged";
}

TEST(FamilyBBodies, KeepMomentumWithoutWeight) {
  Robot robot = thrown(0);
  const Wrench before = robot.plant().momentum_W(robot.state());
  robot.drive({0, 0});
  for (int step = 0; step < 1000; ++step) robot.step();  // through stops and springs, which are within the robot
  const Wrench after = robot.plant().momentum_W(robot.state());
  EXPECT_LT((after.f - before.f).norm(), 1e-5 * before.f.norm());
  EXPECT_LT((after.n - before.n).norm(), 1e-4 * before.n.norm());
}

TEST(FamilyBBodies, KeepMomentumWithEffectsWithinTheRobot) {
  for (const char* effect : {"gear_backlash", "coulomb_friction", "spring_hardening", "stop_compliance",
                             "outside_spring_slip", "wing_inertia", "com_offset", "inertia_products"}) {
    Robot robot = thrown(0, {{effect, 2}});
    State& x = robot.state();
    for (std::size_t j = 0; j < 2; ++j) x[kRotor + j] = x[kStroke + j], x[kRotorRate + j] = x[kStrokeRate + j];
    const Wrench before = robot.plant().momentum_W(x);
    const double energy = robot.plant().energy_J(x, robot.room());
    robot.drive({0, 0});
    for (int step = 0; step < 1000; ++step) robot.step();
    const Wrench after = robot.plant().momentum_W(x);
    EXPECT_LT((after.f - before.f).norm(), 1e-5 * before.f.norm()) << effect;
    EXPECT_LT((after.n - before.n).norm(), 1e-4 * before.n.norm()) << effect;
    EXPECT_LT(robot.plant().energy_J(x, robot.room()), energy) << effect << ": stops take some";
  }
}

TEST(FamilyBBodies, FallFreely) {
  Robot robot(nominal(), {}, open_air(), 1, 0);
  robot.plant().has_air = false;
  robot.put({0, 0, 0}, 0);
  robot.drive({0, 0});
  for (int step = 0; step < 400; ++step) robot.step();
  EXPECT_NEAR(robot.position().z(), -0.5 * kGravity_m_s2 * 0.02 * 0.02, 1e-9);
  EXPECT_LT(robot.felt().acceleration.v.norm(), 1e-6);
}

TEST(FamilyBBodies, FlySymmetricallyWhereTheyAreSymmetric) {
  RobotParameters f = nominal();
  f.torso.com_m.y() = 0;
  f.torso.inertia_kg_m2(0, 1) = f.torso.inertia_kg_m2(1, 0) = f.torso.inertia_kg_m2(1, 2) =
      f.torso.inertia_kg_m2(2, 1) = 0;
  for (Side& s : f.side) {
    s.wing.com_m.x() = 0;
    s.wing.inertia_kg_m2(0, 2) = s.wing.inertia_kg_m2(2, 0) = 0;
  }
  Robot robot(f, {}, open_air(), 1, 0);
  robot.put({0, 0, 0}, 0);
  for (int tick = 0; tick < 120; ++tick) {
    robot.drive(waveform(f, {11, 0, 0.5, 0}, tick * kTick_s));
    for (int step = 0; step < kStepsPerTick; ++step) robot.step();
  }
  EXPECT_GT(robot.position().norm(), 1e-3);
  EXPECT_LT(std::abs(robot.position().y()), 1e-9);
  EXPECT_LT(std::abs(robot.rate().x()) + std::abs(robot.rate().z()), 1e-7);
  EXPECT_NEAR(robot.state()[kStroke], robot.state()[kStroke + 1], 1e-9);
}

/// Where a robot is after some beats, with so many steps a tick.
State flown(int steps_per_tick, int ticks, bool driven) {
  RobotParameters f = nominal();
  if (!driven)
    for (Side& s : f.side) s.motor.torque_constant_Nm_A = 0;
  Robot robot(f, {}, open_air(), 1, 0);
  robot.plant().has_air = robot.plant().has_friction = driven;
  robot.put({0, 0, 0}, 0);
  if (!driven) robot.state()[kStroke] = 1, robot.state()[kStroke + 1] = 0.8;
  for (int tick = 0; tick < ticks; ++tick) {
    robot.drive(driven ? waveform(f, {10, 0.2, 0.3, 0.02}, tick * kTick_s) : std::array<double, 2>{});
    for (int step = 0; step < steps_per_tick; ++step) robot.step(kTick_s / steps_per_tick);
  }
  return robot.state();
}

double apart(const State& a, const State& b, std::size_t from, std::size_t count) {
  double most = 0;
  for (std::size_t k = from; k < from + count; ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

TEST(FamilyBStep, IsOfFourthOrderWhereNothingIsStruck) {
  // 4 ms of wings that swing on their springs: no stop is reached
  const State fine = flown(160, 4, false);
  const double coarse = apart(flown(10, 4, false), fine, kStroke, 8),
               half = apart(flown(20, 4, false), fine, kStroke, 8);
  EXPECT_GT(coarse / half, 12);
  EXPECT_LT(apart(flown(20, 4, false), fine, kStroke, 4), 1e-4) << "of the hinges at the step that is used, rad";
}

TEST(FamilyBStep, IsFineEnough) {
  const State fine = flown(160, 118, true);
  const State chosen = flown(kStepsPerTick, 118, true), half = flown(2 * kStepsPerTick, 118, true);
  const double off = apart(chosen, fine, kPosition, 3), off_half = apart(half, fine, kPosition, 3);
  EXPECT_LT(off, 5e-6) << "of the position after four beats, m";
  EXPECT_GT(off / off_half, 2.5) << "the windings are of second order";
  EXPECT_LT(apart(chosen, fine, kRate, 3), 0.05);
  RecordProperty("position_off_nm", std::to_string(1e9 * off));
  RecordProperty("position_off_of_half_the_step_nm", std::to_string(1e9 * off_half));
}

TEST(FamilyBThrust, CarriesTheWeightAtTenVolts) {
  const RobotParameters f = nominal();
  const double weight = f.mass_kg() * kGravity_m_s2;
  EXPECT_NEAR(held(f, {10, 0, 0, 0}).f.z() / weight, 1, 0.04);
  EXPECT_LT(held(f, {8, 0, 0, 0}).f.z() / weight, 0.8);
}

TEST(FamilyBThrust, TurnsAsTheDriverMeansTo) {
  const RobotParameters f = nominal();
  const Wrench none = held(f, {10, 0, 0, 0});
  EXPECT_GT(held(f, {10, 1, 0, 0}).n.x() - none.n.x(), 0.3e-3) << "roll: the left side goes up";
  EXPECT_GT(held(f, {10, 0, 1, 0}).n.y() - none.n.y(), 0.15e-3) << "pitch: the nose goes down";
  EXPECT_GT(held(f, {10, 0, 0, 0.1}).n.z() - none.n.z(), 0.05e-3) << "yaw: the nose goes left";
}

TEST(FamilyBAir, HasThePublishedCoefficients) {
  // Dickinson, Lehmann, Sane (1999) at 45 degrees, and no lift where symmetry wants none
  EXPECT_NEAR(lift_coefficient(std::numbers::pi / 4),
              0.225 + 1.58 * std::sin((2.13 * 45 - 7.2) * std::numbers::pi / 180), 1e-5);
  EXPECT_NEAR(drag_coefficient(std::numbers::pi / 2), 3.46, 0.01);
  EXPECT_NEAR(lift_coefficient(0), 0, 1e-12);
  EXPECT_NEAR(lift_coefficient(std::numbers::pi / 2), 0, 1e-12);
}

TEST(FamilyBAir, TakesEnergyFromAWingThatMovesAnyWay) {
  const Plant p = plant();
  for (int way = 0; way < 16; ++way) {
    const double angle = way * std::numbers::pi / 8;
    WingAir::Flow flow;
    flow.shoulder_m_s = Vector3d(3 * std::cos(angle), 0, 3 * std::sin(angle));
    flow.rate_rad_s = Vector3d::Zero();
    EXPECT_LT(p.wing(0).load(flow).force_N.dot(flow.shoulder_m_s), 0) << way;
  }
}

TEST(FamilyBAir, LagsAsWagnersFunction) {
  // From rest, lift is half of what it becomes.
  const Plant p = plant();
  WingAir::Flow flow;
  flow.shoulder_m_s = Vector3d(2, 0, 2);
  flow.rate_rad_s = Vector3d::Zero();
  WingAir::Load load = p.wing(0).load(flow);
  const auto lift = [](const WingAir::Load& l) { return (l.force_N.z() - l.force_N.x()) / std::sqrt(2); };
  const double begins = lift(load);
  for (int step = 0; step < 40000; ++step) {
    for (std::size_t i = 0; i < 2; ++i) flow.lag[i] += 1e-4 * load.lag_rate[i];
    load = p.wing(0).load(flow);
  }
  EXPECT_GT(begins / lift(load), 0.4);
  EXPECT_LT(begins / lift(load), 0.65);
}

double law1(const std::string& effect, const std::vector<double>& at, std::size_t which = 0) {
  return law_of(effect, at).at(which);
}

TEST(FamilyBLaws, AreWrittenDownForEachEffect) {
  const std::vector<double> at = {0.2, 0.3, 0.4, 10, 20};
  for (const FamilyEffect& e : family_effects()) {
    EXPECT_FALSE(e.law.empty() || e.source.empty() || e.numbers.empty()) << e.id;
    EXPECT_LE(e.numbers.size(), 5U) << e.id;
    for (const double x : e.numbers) EXPECT_GT(x, 0) << e.id;
    const bool geometry = e.id == "com_offset" || e.id == "inertia_products" || e.id == "wing_inertia";
    const std::vector<double> law = law_of(e.id, at);
    EXPECT_EQ(law.empty(), geometry || e.id.starts_with("outside_")) << e.id;
    for (const double x : law) EXPECT_TRUE(std::isfinite(x)) << e.id;
  }
}

TEST(FamilyBLaws, AreOfTheShippedRobot) {
  const RobotParameters read = nominal(), f = nominal_parameters();
  const auto same = [](const Link& a, const Link& b) {
    return a.mass_kg == b.mass_kg && a.com_m == b.com_m && a.inertia_kg_m2.isApprox(b.inertia_kg_m2, 1e-12);
  };
  EXPECT_EQ(f.density_kg_m3, read.density_kg_m3);
  EXPECT_EQ(f.flapping_Hz, read.flapping_Hz);
  EXPECT_EQ(f.hold_s, read.hold_s);
  EXPECT_EQ(f.amplitude_limit_V, read.amplitude_limit_V);
  EXPECT_EQ(f.split_cycle_limit, read.split_cycle_limit);
  EXPECT_EQ(f.around_m, read.around_m);
  EXPECT_EQ(f.above_m, read.above_m);
  EXPECT_TRUE(same(f.torso, read.torso));
  for (std::size_t j = 0; j < 2; ++j) {
    const Side &a = f.side[j], &b = read.side[j];
    EXPECT_TRUE(same(a.edge, b.edge) && same(a.wing, b.wing)) << j;
    EXPECT_EQ(a.shoulder_m, b.shoulder_m);
    EXPECT_EQ(a.stroke.upper_rad, b.stroke.upper_rad);
    EXPECT_EQ(a.rotation.lower_rad, b.rotation.lower_rad);
    EXPECT_EQ(a.rotation.friction_Nm, b.rotation.friction_Nm);
    EXPECT_EQ(a.motor.resistance_ohm, b.motor.resistance_ohm);
    EXPECT_EQ(a.motor.friction_Nm, b.motor.friction_Nm);
    EXPECT_EQ(a.motor.rotor_inertia_kg_m2, b.motor.rotor_inertia_kg_m2);
    EXPECT_EQ(a.stiffness_positive_Nm_rad, b.stiffness_positive_Nm_rad);
    EXPECT_EQ(a.wing_length_m, b.wing_length_m);
    EXPECT_EQ(a.mean_chord_m, b.mean_chord_m);
  }
}

TEST(FamilyBLaws, OfAirHaveTheirLimits) {
  // far from the ground, the first term of the binomial series
  EXPECT_NEAR(law1("ground_effect", {2}), 2.0 / 3 * kGroundShare * std::pow(kSpan_m / 2, 2), 2e-6);
  EXPECT_LT(law1("ground_effect", {0}), 0.2) << "it stays finite";
  EXPECT_LT(law1("ceiling_effect", {0}), 0.2);
  // a vortex ring's field on its axis falls as the cube of the distance
  EXPECT_NEAR(law1("wall_effect", {20.084}) / law1("wall_effect", {10.084}), 1.0 / 8, 1e-4);
  EXPECT_EQ(law1("clap_and_fling", {1.06}), 0);
  EXPECT_NEAR(law1("clap_and_fling", {1e-9}), kClapShare, 1e-6);
  EXPECT_NEAR(law1("wing_damage", {1}), 1, 1e-12) << "nothing is left at the tip";
  EXPECT_EQ(law1("wing_damage", {0.5}), 0);
  const double most = WingAir::bend_share(0.324);
  EXPECT_NEAR(most, 1, 1e-4) << "where the chord is longest";
  EXPECT_NEAR(law1("wing_flexibility", {0.9, 1}) / law1("wing_flexibility", {0.324, 1}),
              std::pow(std::pow(0.9 / 0.324, 0.1885) * std::pow(0.1 / 0.676, 0.3958), 3), 0.01);
  // the spectrum's integral over frequency is 1; to 1 kHz all but (6 f L / U)^(-2/3) of it
  double sum = 0;
  for (double f = 1e-5; f < 1e3; f *= 1.01) sum += 0.5 * (gust_density(f, 0) + gust_density(1.01 * f, 0)) * 0.01 * f;
  EXPECT_NEAR(sum, 1 - std::pow(6e3 * kEddy_m / kWind_m_s, -2.0 / 3), 2e-3);
  EXPECT_NEAR(law1("wind", {kWindAt_m, 1}), 1, 1e-12);
  // wings turned about their leading edge are pushed by what they turn into: no speed, no force
  EXPECT_EQ(law1("rotational_lift", {0.5, 0, 100}), 0);
  EXPECT_NEAR(law1("rotational_lift", {0.5, 200, 100}), -law1("rotational_lift", {0.5, 200, -100}), 1e-12);
}

TEST(FamilyBLaws, OfGustsHaveTheVarianceOfTheirBand) {
  double along = 0, expected = 0;
  const int many = 200;
  for (int seed = 0; seed < many; ++seed) {
    const Gusts gusts(Random(static_cast<std::uint64_t>(seed), 0, Stream::kEffect, kWind));
    along += std::pow(gusts.at(3.3).x(), 2) / many;
  }
  // from 0.02 to 25 Hz
  const auto beyond = [](double f) { return std::pow(1 + 6 * f * kEddy_m / kWind_m_s, -2.0 / 3); };
  expected = kGust_m_s * kGust_m_s * (beyond(0.02) - beyond(25));
  EXPECT_NEAR(along / expected, 1, 4 * std::sqrt(2.0 / many)) << "four sd of a variance of 200 normals";
}

TEST(FamilyBLaws, OfAddedMassAreLagranges) {
  // kinetic energy of the air: (a00 r'^2 + 2 a01 cos r  r' p' + a11 cos^2 r  p'^2) / 2, p stroke, r rotation
  const Plant with = plant({{"added_mass", 1}});
  const Eigen::Matrix3d& a = with.wing(0).added();
  for (const double r : {-0.7, 0.2, 0.6}) {
    const double p1 = 170, r1 = -90, p2 = 3e4, r2 = -2e4, c = std::cos(r), s = std::sin(r);
    const double stroke = -(a(0, 1) * (c * r2 - s * r1 * r1) + a(1, 1) * (c * c * p2 - 2 * c * s * r1 * p1));
    const double rotation = -(a(0, 0) * r2 + a(0, 1) * c * p2 + a(1, 1) * c * s * p1 * p1);
    EXPECT_NEAR(law1("added_mass", {r, p1, r1, p2, r2}), stroke, 1e-9 * std::abs(stroke));
    EXPECT_NEAR(law1("added_mass", {r, p1, r1, p2, r2}, 1), rotation, 1e-9 * std::abs(rotation));
  }
}

TEST(FamilyBLaws, OfDrivesHaveClosedForms) {
  const double i = 0.7, t = 4;
  EXPECT_NEAR(law1("battery_sag", {t, i}),
              i * (kCell_ohm + kRelaxing_ohm * (1 - std::exp(-t / kRelaxes_s)) + kDischarge_V_As * t), 1e-9);
  // early, all heat stays in the winding; late, it flows through both resistances
  EXPECT_NEAR(law1("winding_heating", {0.02, 1}), kCopper_K * 0.02 / kWinding_J_K, 1e-5);
  EXPECT_NEAR(law1("winding_heating", {600, 1}), kCopper_K * (kInside_K_W + kOutside_K_W), 1e-4);
  EXPECT_NEAR(law1("winding_heating", {600, 1}, 1), -kMagnet_K * kOutside_K_W, 1e-4);
  EXPECT_NEAR(law1("driver_bandwidth", {kMean_s / 4}), -7.5, 1e-9);
  EXPECT_NEAR(law1("driver_bandwidth", {5e-3}), 0, 1e-9);
  EXPECT_NEAR(law1("driver_dead_zone", {-18, 0}), 82e3 * 220e-9 * 19.6, 0.005);
  EXPECT_NEAR(law1("spring_hardening", {0.2}), -0.013384289 * kStiffShare * std::pow(0.2, 3) / (6 * 0.55 * 0.55),
              1e-6 * 0.2)
      << "the first term of the series";
  EXPECT_EQ(law1("gear_backlash", {0.007, 3}), 0);
  EXPECT_EQ(law1("gear_backlash", {0.008, -20}), 0) << "it transmits no pull";
  EXPECT_NEAR(law1("gear_backlash", {-0.02, 0}), -kShaft_Nm_rad * (0.02 - kPlay_rad / 2), 1e-12);
  // pad and stop in series: their depths add up
  const double torque = law1("stop_compliance", {0.1, 0});
  EXPECT_NEAR(std::pow(torque / kRotationStop, 2.0 / 3) + torque / kPad_Nm_rad, 0.1, 1e-9);
  EXPECT_EQ(law1("stop_compliance", {0.1, -150}), 0) << "it never pulls";
  EXPECT_NEAR(law1("command_delay", {6}) - law1("command_delay", {7}), 2 * kDelayTurns_s, 1e-15);
  // bristles that have slid for long
  double z = 0;
  for (int step = 0; step < 20000; ++step) z += 1e-5 * bristle_rate(30, z);
  EXPECT_NEAR(law1("coulomb_friction", {30}), bristle_torque(z, 1), 1e-9);
}

TEST(FamilyBLaws, OfSensorsHaveClosedForms) {
  // mean square of a sinusoid behind a low-pass of first order; sampling changes it by (f h)^2
  for (const double f : {40.0, 200.0}) {
    const double gain = 1 / (1 + std::pow(f / SensorTruth{}.bandwidth_hz, 2));
    EXPECT_NEAR(law1("vibration_rectification", {30, f}), kSquare_s2_m * (9.81 * 9.81 + 450 * gain), 0.01) << f;
  }
  // of markers, against the fit by singular values; what is of second order is (4.1 / 35)^2 of it
  const EffectMagnitudes drawn = effect_magnitudes_of({}, 1);
  std::array<Vector3d, 4> seen = kMarkers_m;
  seen[drawn.marker] += drawn.marker_m;
  Vector3d was = Vector3d::Zero(), is = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) was += kMarkers_m[k] / 4, is += seen[k] / 4;
  Matrix3d across = Matrix3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) across += (seen[k] - is) * (kMarkers_m[k] - was).transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(across, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::AngleAxisd fitted(turn);
  const Vector3d shift = is - turn * was;
  const std::vector<double> law = law_of("marker_offset", std::vector<double>{0, 0, 0});
  EXPECT_LT((Vector3d(law[0], law[1], law[2]) - shift).norm(), 0.1 * shift.norm());
  EXPECT_LT((Vector3d(law[3], law[4], law[5]) - fitted.angle() * fitted.axis()).norm(), 0.1 * fitted.angle());
  // a triangular matrix leaves z alone, and lengths along x
  EXPECT_EQ(law_of("accelerometer_misalignment", std::vector<double>{3, 0, 0}), (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(law1("accelerometer_misalignment", {1, 2, 3}, 2), 0);
  const std::vector<double> tilt = law_of("mocap_tilt", std::vector<double>{0.3, -0.4, 1});
  const Vector3d place(0.3, -0.4, 1), moved = place + Vector3d(tilt[0], tilt[1], tilt[2]);
  EXPECT_NEAR(std::abs(moved.norm() / place.norm() - 1), kWand, 1e-12);
  EXPECT_NEAR(std::abs(law1("mocap_delay", {10})), 8.7e-4 * 11.6, 1e-12);
}

TEST(FamilyBEnergy, IsOnlyLostWhereSomethingRubs) {
  // hardening keeps it, the slipping clamp loses it; neither adds any
  for (const auto& [effect, loses] : {std::pair{"spring_hardening", false}, {"outside_spring_slip", true}}) {
    RobotParameters f = nominal();
    for (Side& s : f.side) s.motor.torque_constant_Nm_A = 0;
    Robot robot(f, effect_magnitudes_of({{effect, 2}}, 3), open_air(), 1, 0);
    robot.plant().has_air = robot.plant().has_friction = false;
    robot.put({0, 0, 0}, 0);
    State& x = robot.state();
    x[kStrokeRate] = 80, x[kStrokeRate + 1] = 70;
    const double before = robot.plant().energy_J(x, robot.room());
    double now = before, most = 0;
    robot.drive({0, 0});
    for (int step = 0; step < 800; ++step) {
      // friction within the wings' stops ends the test
      if (std::abs(x[kRotation]) > 0.75 || std::abs(x[kRotation + 1]) > 0.75) break;
      robot.step();
      const double energy = robot.plant().energy_J(x, robot.room());
      EXPECT_LT(energy, now + 1e-9 * before) << effect << " " << step;
      now = energy;
      most = std::max(most, std::abs(x[kStroke]));
    }
    EXPECT_GT(most, 0.3) << effect;
    if (loses) EXPECT_LT(now, before * (1 - 1e-3));
    else EXPECT_NEAR(now, before, 1e-8 * before);
  }
}

TEST(FamilyBEnergy, IsNotMadeByGearsStopsAndBristles) {
  // work that each takes over a closed path of sinusoids, by the law alone
  double gear = 0, stop = 0, bristles = 0, z = 0;
  const double h = 1e-5;
  for (int step = 0; step < 30000; ++step) {
    const double t = h * step, w = 2 * kPi * 34, a = 0.03 * std::sin(w * t), v = 0.03 * w * std::cos(w * t);
    gear += h * backlash_torque(a, v, 1) * v;
    stop += h * pad_torque(kRotationStop, 5 * a, 5 * v, 1) * 5 * v;
    z += h * bristle_rate(30 * v, z);
    bristles -= h * bristle_torque(z, 1) * 30 * v;
  }
  EXPECT_GT(gear, 1e-6);
  EXPECT_GT(stop, 1e-6);
  EXPECT_GT(bristles, 1e-6);
}

TEST(FamilyBAir, FlapLosesLoadInOneHalfStrokeOfOneWing) {
  const EffectMagnitudes drawn = effect_magnitudes_of({}, 3);
  const auto side = static_cast<std::size_t>(drawn.torn_side);
  const auto share = [&](double velocity, std::size_t of) {
    WingAir::Flow flow;
    flow.shoulder_m_s = Vector3d(velocity, 0, 0);
    flow.rate_rad_s.setZero();
    return plant({{"outside_torn_flap", 1}}).wing(of).load(flow).force_N.x() / plant().wing(of).load(flow).force_N.x();
  };
  EXPECT_LT(share(8 * drawn.flap_opens, side), 0.97);
  EXPECT_NEAR(share(-8 * drawn.flap_opens, side), 1, 1e-4);
  EXPECT_EQ(share(8 * drawn.flap_opens, 1 - side), 1);
}

TEST(FamilyBAir, PushesAWingInHoverAsTheBendingAssumes) {
  Robot robot(nominal(), {}, open_air(), 1, 0);
  robot.plant().has_air = true;
  const Path path{{2, {0, 0, 0, 1}}, {2, Twist{Vector3d::Zero(), Vector3d(0, 0, kGravity_m_s2)}}};
  robot.put({0, 0, 0}, 0);
  double sum = 0;
  int count = 0;
  for (int tick = 0; tick < 235; ++tick) {
    robot.drive(Beat{10, 0, 0, 0}, tick * kTick_s);
    for (int step = 0; step < kStepsPerTick; ++step) {
      robot.led_step(path, 0);
      if (tick < 118) continue;
      const State& x = robot.state();
      WingAir::Flow flow;
      flow.shoulder_m_s.setZero();
      flow.sin_rotation = std::sin(x[kRotation]), flow.cos_rotation = std::cos(x[kRotation]);
      flow.rate_rad_s =
          Vector3d(-flow.sin_rotation * x[kStrokeRate], x[kRotationRate], flow.cos_rotation * x[kStrokeRate]);
      flow.lag = {x[kLag], x[kLag + 1]};
      sum += std::abs(robot.plant().wing(0).load(flow).force_N.x());
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, kHoverNormal_N, 0.05 * kHoverNormal_N);
}

TEST(FamilyBDriver, HoldsItsVoltageAsTheFileSays) {
  for (const double hold_s : {0.25e-3, 1e-3, 4e-3}) {
    RobotParameters f = nominal();
    f.hold_s = hold_s;
    Robot robot(f, {}, open_air(), 1, 0);
    robot.put({0, 0, 0}, 0);
    const Beat beat{10, 0, 0, 0};
    for (int step = 0; step < 160; ++step) {
      if (step % kStepsPerTick == 0) robot.drive(beat, step * kStep_s);
      robot.step();
      const double since = std::floor(step * kStep_s / hold_s + 1e-6) * hold_s;
      EXPECT_NEAR(robot.voltage_V()[0], waveform(f, beat, since)[0], 1e-9) << hold_s << " " << step;
    }
  }
}

TEST(FamilyBDriver, DelaysTheBeatsInTurn) {
  // a ramp, so that a delay is a voltage
  Robot robot(nominal(), effect_magnitudes_of({{"command_delay", 1}}, 3), open_air(), 1, 0);
  robot.put({0, 0, 0}, 0);
  for (int tick = 0; tick < 110; ++tick) {
    robot.drive({0.01 * tick, 0});
    robot.step();
    for (int step = 1; step < kStepsPerTick; ++step) robot.step();
    const int beat = static_cast<int>(tick * kTick_s * 34 + 0.5e-3 * 34);
    if (tick > 10 && std::abs((tick + 1) * kTick_s * 34 - std::round((tick + 1) * kTick_s * 34)) > 0.1)
      EXPECT_NEAR(0.01 * tick - robot.voltage_V()[0], 10 * law1("command_delay", {static_cast<double>(beat)}), 0.011)
          << tick;
  }
}

}  // namespace
}  // namespace flappy::blind::b
