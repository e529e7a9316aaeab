// Loads of the wings against what the simulator gives to the body, and against their definitions.
#include "sim/wing_loads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flappy/batch.hpp"
#include "model/effects/registry.hpp"
#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::sim::wing_loads_test {
namespace {

using Loads = std::array<MeanWingLoads, 2>;

/// A welded or flying robot of one lane, whose loads can be read.
class Robot {
 public:
  explicit Robot(const model::Vehicle& v, double step_s = 1e-4, Start start = Start::welded,
                 const FlapperState& state = {})
      : batch_(1, v, options(step_s)), step_s_(step_s) {
    storage_of(batch_).keep_effects(0);
    storage_of(batch_).put_effect_rows(0, v);
    batch_.reset(0, state, start);
  }
  static BatchOptions options(double step_s) {
    BatchOptions o;
    o.step_s = step_s;
    o.threads = 1;
    o.world.ground_z_m = -100;
    return o;
  }
  /// Loads of the next `steps`, at these voltages, which the batch then flies.
  Loads step(int steps, double left_V, double right_V) {
    batch_.set_voltages(0, left_V, right_V);
    auto& body = storage_of(batch_);
    const std::vector<StepVoltage> voltages(static_cast<std::size_t>(steps), {left_V, right_V});
    const Loads loads = mean_wing_loads<double>(body.blocks[0], body.effects_of(0), body.plan(), 0, voltages);
    batch_.step(steps);
    return loads;
  }
  Batch<double>& batch() { return batch_; }
  double step_s() const { return step_s_; }

 private:
  Batch<double> batch_;
  double step_s_;
};

/// Largest difference of the sum of both wings from an impulse over a time, over the largest number of either.
double difference(const Loads& loads, const HeldImpulse& before, const HeldImpulse& after, double seconds) {
  double most = 0, largest = 0;
  for (int i = 0; i < 3; ++i)
    for (const auto& [wings, body] :
         {std::pair(loads[0].force_N[i] + loads[1].force_N[i], (after.force_N_s[i] - before.force_N_s[i]) / seconds),
          std::pair(loads[0].moment_Nm[i] + loads[1].moment_Nm[i],
                    (after.moment_Nm_s[i] - before.moment_Nm_s[i]) / seconds)})
      most = std::max(most, std::abs(wings - body)), largest = std::max(largest, std::abs(body));
  return most / largest;
}

model::Vehicle with_all_effects(model::Vehicle v) {
  for (const model::CatalogueEffect& e : model::effects())
    for (const model::EffectParameter& p : e.parameters) v.effects[e.info.id][p.name] = p.typical;
  return v;
}

/// Sums of some hundred numbers, each rounded to 1e-16, of which the impulse keeps the sum of all before.
TEST(WingLoads, SumToWhatTheSimulatorGivesToTheBody) {
  for (const auto& [vehicle, name] :
       {std::pair(test::nominal(), "nominal"), std::pair(test::identified(), "identified")}) {
    model::Vehicle v = vehicle;
    for (const bool with_effects : {false, true}) {
      if (with_effects) v = with_all_effects(v);
      Robot r(v);
      for (int beat = 0; beat < 6; ++beat)
        for (const double volt : {12.0, -11.0}) {
          const HeldImpulse before = r.batch().held_impulse(0);
          const Loads loads = r.step(150, volt, 0.8 * volt);
          EXPECT_LT(difference(loads, before, r.batch().held_impulse(0), 150 * r.step_s()), 1e-11)
              << name << with_effects << beat;
          EXPECT_GT(std::abs(loads[0].force_N[2]), 1e-4);
        }
    }
  }
}

/// A wing that strokes alone, its chord turned by 0.6 rad: the force is normal to the chord, so lift over drag is tan 0.6; all
/// air acts at r_cp = R r33/r22, so the power is drag times the speed there; forces grow with the square, power with the cube.
TEST(WingLoads, AreThoseOfTheirDefinitions) {
  const model::Vehicle v = test::nominal();
  const auto at = [&](double rate, double turned) {
    FlapperState s;
    for (int i = 0; i < 2; ++i) s.stroke_rate_rad_s[i] = rate, s.rotation_rad[i] = turned;
    Robot r(v, 1e-6, Start::welded, s);  // in a step of 1 us neither rate nor angle changes by more than 1e-3 of itself
    return r.step(1, 0, 0);
  };
  const Loads slow = at(100, -0.6), fast = at(200, -0.6), back = at(-100, 0.6), rest = at(0, 0.3);
  const double r_cp = v.left.planform.wing_length_m * v.left.planform.r33 / v.left.planform.r22;
  for (const std::size_t side : {0, 1}) {
    const MeanWingLoads& w = slow[side];
    EXPECT_GT(w.lift_N, 1e-3);
    EXPECT_GT(w.drag_N, 1e-3);
    EXPECT_NEAR(w.lift_N / w.drag_N, std::tan(0.6), 2e-3);
    EXPECT_NEAR(w.lift_N, w.force_N[2], 2e-3 * w.lift_N);  // the stroke is level
    EXPECT_NEAR(w.drag_N, w.force_N[0], 2e-3 * w.drag_N);  // a stroke backward is held back by a force forward
    EXPECT_NEAR(w.aerodynamic_power_W, w.drag_N * r_cp * 100, 5e-3 * w.aerodynamic_power_W);
    EXPECT_NEAR(fast[side].lift_N / w.lift_N, 4, 0.02);
    EXPECT_NEAR(fast[side].aerodynamic_power_W / w.aerodynamic_power_W, 8, 0.05);
    // the other way with the chord turned the other way: the same lift, the force turned over
    EXPECT_NEAR(back[side].lift_N, w.lift_N, 2e-3 * w.lift_N);
    EXPECT_NEAR(back[side].drag_N, w.drag_N, 2e-3 * w.drag_N);
    EXPECT_NEAR(back[side].force_N[0], -w.force_N[0], 2e-3 * w.drag_N);
    // no voltage: the motor brakes, by (K N)^2 eta/R
    const model::Motor& m = (side == 0 ? v.left : v.right).motor;
    const double brake_W = m.efficiency * std::pow(m.torque_constant_Nm_A * m.gear_ratio * 100, 2) / m.resistance_ohm;
    EXPECT_NEAR(w.mechanical_power_W, -brake_W, 5e-3 * brake_W);
    EXPECT_LT(std::abs(rest[side].lift_N) + std::abs(rest[side].drag_N) + std::abs(rest[side].aerodynamic_power_W),
              1e-6);
  }
  // a wing that turns about its own axis alone gives M_rd theta' to the air
  FlapperState turning;
  turning.rotation_rate_rad_s[0] = turning.rotation_rate_rad_s[1] = -80;
  const model::Planform& p = v.left.planform;
  const double turning_W = v.air_density_kg_m3 / 8 * std::pow(80, 3) * p.rotational_damping_coefficient *
                           p.wing_length_m * std::pow(p.mean_chord_m, 4) * p.z_rd;
  for (const MeanWingLoads& w : Robot(v, 1e-6, Start::welded, turning).step(1, 0, 0))
    EXPECT_NEAR(w.aerodynamic_power_W, turning_W, 5e-3 * turning_W);
  // a motor at 10 V drives by its current, less that of the back-EMF
  FlapperState driven;
  driven.stroke_rate_rad_s[0] = driven.stroke_rate_rad_s[1] = 50;
  const model::Motor& m = v.left.motor;
  const double kn = m.torque_constant_Nm_A * m.gear_ratio,
               drive_W = m.efficiency * kn / m.resistance_ohm * (10 - kn * 50) * 50;
  EXPECT_NEAR(Robot(v, 1e-6, Start::welded, driven).step(1, 10, 0)[0].mechanical_power_W, drive_W, 5e-3 * drive_W);
  // wings in a mirror
  for (const double sign : {1.0, -1.0}) {
    const MeanWingLoads &l = sign > 0 ? slow[0] : back[0], &r = sign > 0 ? slow[1] : back[1];
    for (const int i : {0, 2}) EXPECT_NEAR(l.force_N[i], r.force_N[i], 1e-3 * l.drag_N);
    EXPECT_NEAR(l.force_N[1], -r.force_N[1], 1e-3 * l.drag_N);
    for (const int i : {0, 2}) EXPECT_NEAR(l.moment_Nm[i], -r.moment_Nm[i], 1e-3 * std::abs(l.moment_Nm[i]));
    EXPECT_NEAR(l.aerodynamic_power_W, r.aerodynamic_power_W, 1e-3 * l.aerodynamic_power_W);
  }
}

/// Without friction, damping of the motor and turns of the wing, springs and inertia give back what they take: over beats
/// that repeat, the motor gives what the air takes. Beats of 30 ms, after 20 that settle; steps of 50 us leave errors of
/// w h/2 = 5e-3 of the energy that swings to and fro, which is a few times what the air takes.
TEST(WingLoads, BalanceInBeatsThatRepeat) {
  model::Vehicle v = test::nominal();
  for (model::Side* s : {&v.left, &v.right}) {
    s->motor.friction_Nm = s->motor.damping_Nm_s = s->motor.rotor_spin_sense = 0;
    s->rotation = {-0.5, -0.5, 0, 0};
  }
  Robot r(v, 5e-5);
  double air_J = 0, motor_J = 0;
  for (int beat = 0; beat < 30; ++beat)
    for (int k = 0; k < 30; ++k) {
      const double volt = 10 * std::cos(2 * std::numbers::pi * k / 30);
      const Loads loads = r.step(20, volt, volt);
      if (beat < 20) continue;
      for (const MeanWingLoads& w : loads)
        air_J += 1e-3 * w.aerodynamic_power_W, motor_J += 1e-3 * w.mechanical_power_W;
    }
  EXPECT_GT(air_J, 0.01);
  EXPECT_NEAR(motor_J, air_J, 0.02 * air_J);
}

}  // namespace
}  // namespace flappy::sim::wing_loads_test
