#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "lab/blind/b/family_b_tests.hpp"

namespace flappy::blind::b {
namespace {

/// A robot without motors, friction and air, thrown with everything moving.
Robot thrown(double gravity) {
  RobotParameters f = nominal();
  for (Side& s : f.side) s.motor.torque_constant_Nm_A = 0;
  Surroundings room = open_air();
  room.gravity_m_s2 = gravity;
  Robot robot(f, {}, room, 1, 0);
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

}  // namespace
}  // namespace flappy::blind::b
