// The stand against what can be said without it.
#include "design/stand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fixture.hpp"
#include "flappy/batch.hpp"
#include "model/wing_beat.hpp"

namespace flappy::design {
namespace {

constexpr double kStep_s = 250e-6, kGravity_m_s2 = 9.81;

struct Measured {
  DesignConfig config = small_config();
  Robot robot = build(config.judge.space, config.judge.space.built);
  double flown_s = 0;
  Stand stand = measure(robot, config.judge.space.workshop, kStep_s, kGravity_m_s2, flown_s);
};
const Measured& published() {
  static const Measured made;
  return made;
}

TEST(Stand, LiftAtTheAmplitudeOfHoverIsTheWeight) {
  const Stand& s = published().stand;
  ASSERT_TRUE(s.hovers);
  const double weight = whole_body(published().robot.vehicle).mass_kg * kGravity_m_s2;
  EXPECT_NEAR(s.hover.lift_N / weight, 1, 0.01);  // linear between amplitudes 1 V apart
}

/// In double precision, with short steps, over other beats and by the mean force itself.
TEST(Stand, LiftIsTheMeanForceOfASimulatorWithShortSteps) {
  const Stand& s = published().stand;
  sim::BatchOptions options;
  options.step_s = 25e-6;
  options.threads = 1;
  sim::Batch<double> batch(1, published().robot.vehicle, options);
  batch.reset(0, {}, sim::Start::welded);
  batch.set_input(0, {s.hover.amplitude_V, 0, 0, 0});
  const auto steps = [](double t_s) { return static_cast<int>(std::lround(t_s / 25e-6)); };
  batch.step(steps(20 / 34.0));
  const sim::HeldImpulse before = batch.held_impulse(0);
  batch.step(steps(17 / 34.0));
  const double lift = (batch.held_impulse(0).force_N_s[2] - before.force_N_s[2]) / (17 / 34.0);
  EXPECT_NEAR(s.hover.lift_N / lift, 1, 0.01);
}

/// The losses of both motors by short steps, whose currents are those of their ends.
TEST(Stand, WindingIsHeatedByTheMeanSquareOfTheCurrent) {
  const Stand& s = published().stand;
  const model::Vehicle& v = published().robot.vehicle;
  const model::Motor& m = v.left.motor;
  sim::BatchOptions options;
  options.step_s = 25e-6;
  options.threads = 1;
  sim::Batch<double> batch(1, v, options);
  batch.reset(0, {}, sim::Start::welded);
  batch.set_input(0, {s.hover.amplitude_V, 0, 0, 0});
  double square_A2 = 0;
  long steps = 0;
  for (long k = 0; k < 1000 * 40; ++k) {
    const long hold = k / 40;  // of 1 ms
    batch.step(1);
    if (hold < 500) continue;
    double beat = static_cast<double>(hold) * v.driver.hold_s * v.driver.flapping_Hz;
    beat -= std::round(beat);
    const double volts = model::wing_beat_voltage<1>(model::WingBeat<double>{s.hover.amplitude_V, 0, 0, 0}, beat, 18.0);
    const double current =
        (volts - m.torque_constant_Nm_A * m.gear_ratio * batch.state(0).stroke_rate_rad_s[0]) / m.resistance_ohm;
    square_A2 += current * current;
    ++steps;
  }
  const double expected =
      winding_C(std::sqrt(square_A2 / static_cast<double>(steps)), *published().robot.motor,
                published().config.judge.space.workshop.ambient_C, published().config.judge.space.workshop.flight_s);
  EXPECT_NEAR((s.hover.winding_C - 25) / (expected - 25), 1, 0.01);
}

TEST(Stand, InputsMoveTheirOwnAxesAndSymmetricRobotsDoNotCouple) {
  const Stand& s = published().stand;
  for (std::size_t a = 0; a < kAxes; ++a) {
    EXPECT_GT(s.authority_Nm[a], 0);
    for (std::size_t of = 0; of < kAxes; ++of)
      if (a != of) EXPECT_LT(std::abs(s.moment_per_input[a][of]), 0.1 * std::abs(s.moment_per_input[a][a]));
  }
}

/// Held, the air pushes as before; a centre of mass that lies d ahead gets the lift's moment -d F_z about y less.
TEST(Stand, MomentsAreAboutTheCentreOfMass) {
  Measured m;
  m.robot.vehicle.torso.com_m.x += 1e-3;
  const Stand s = measure(m.robot, m.config.judge.space.workshop, kStep_s, kGravity_m_s2, m.flown_s);
  const double ahead = whole_body(m.robot.vehicle).com_m.x - whole_body(published().robot.vehicle).com_m.x;
  EXPECT_GT(ahead, 0.5e-3);
  const StandPoint &was = published().stand.sweep[8], &now = s.sweep[8];
  EXPECT_NEAR(now.moment_Nm[1] - was.moment_Nm[1], ahead * was.lift_N, 1e-3 * ahead * was.lift_N);
  EXPECT_NEAR(now.moment_Nm[0], was.moment_Nm[0], 1e-9);
}

/// A motor that cannot turn draws V/R: its losses are A^2/(2 R), all of the power, and its current is at most A/R.
TEST(Stand, ABlockedMotorDrawsTheVoltageOverItsResistance) {
  Measured m;
  for (model::Side* side : {&m.robot.vehicle.left, &m.robot.vehicle.right}) side->stroke.friction_Nm = 10;
  const Stand s = measure(m.robot, m.config.judge.space.workshop, kStep_s, kGravity_m_s2, m.flown_s);
  EXPECT_FALSE(s.hovers);
  const MotorType& motor = *m.robot.motor;
  const StandPoint& p = s.sweep.front();  // at the larger amplitudes the winding would burn
  const double V = p.amplitude_V, R = motor.resistance_ohm, rms_A = V / R / std::sqrt(2);
  EXPECT_NEAR(p.power_W / (2 * V * V / (2 * R)), 1, 0.01);
  EXPECT_NEAR(p.current_A / (V / R), 1, 0.01);
  EXPECT_NEAR(p.winding_C,
              winding_C(rms_A, motor, m.config.judge.space.workshop.ambient_C, m.config.judge.space.workshop.flight_s),
              0.5);
  EXPECT_LT(p.stroke_rad, 1e-3);
}

TEST(Winding, IsAtTheTemperatureAtWhichItLosesWhatItConducts) {
  MotorType m;
  m.resistance_ohm = 10, m.winding_K_W = 30, m.housing_K_W = 70, m.winding_s = 4, m.housing_s = 200;
  EXPECT_DOUBLE_EQ(winding_C(0, m, 20, 1e9), 20);
  EXPECT_DOUBLE_EQ(winding_C(0.2, m, 20, 0), 20);
  const double T = winding_C(0.2, m, 20, 1e9);
  EXPECT_NEAR((T - 20) / 100, 0.2 * 0.2 * 10 * (1 + 0.0039 * (T - 25)), 1e-12);
  EXPECT_TRUE(std::isinf(winding_C(2, m, 20, 1e9)));
  // two bodies integrated in time: the losses are smaller at first, so that the law is above, but not by much
  double winding = 0, housing = 0;
  for (double t = 0; t < 60; t += 1e-3) {
    const double loss = 0.2 * 0.2 * 10 * (1 + 0.0039 * (20 + winding + housing - 25));
    winding += 1e-3 / m.winding_s * (m.winding_K_W * loss - winding);
    housing += 1e-3 / m.housing_s * (m.housing_K_W * loss - housing);
  }
  EXPECT_GT(winding_C(0.2, m, 20, 60), 20 + winding + housing);
  EXPECT_NEAR((winding_C(0.2, m, 20, 60) - 20) / (winding + housing), 1, 0.03);
}

/// The rated currents of the Faulhaber 0816 are those that heat its winding to the limit of its data sheet, 85 degrees.
TEST(Winding, PredictsTheRatedCurrentsOfADataSheet) {
  const Workshop& w = published().config.judge.space.workshop;
  const std::pair<const char*, double> kRated_A[] = {
      {"faulhaber_0816_003", 0.37}, {"faulhaber_0816_006", 0.19}, {"faulhaber_0816_009", 0.13}};
  for (const auto& [name, rated_A] : kRated_A) {
    const auto motor = std::ranges::find(w.motors, name, &MotorType::name);
    ASSERT_NE(motor, w.motors.end());
    EXPECT_NEAR(winding_C(rated_A, *motor, 22, 1e9), 85, 6) << name;  // 4 % of a rounded current are 5 K
  }
}

}  // namespace
}  // namespace flappy::design
