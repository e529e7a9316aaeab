// Family A is the blind robot of its own programs, with figures and sensors drawn where an assignment asks for it.
#include "blind/a/family_a.hpp"

#include <gtest/gtest.h>

#include "blind/a/sampled_robot.hpp"
#include "full.hpp"

namespace flappy::blind {
namespace {

Assignment assignment() {
  Assignment a;
  a.vehicle_file = FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml";
  a.seed = 41;
  a.hover = true;
  return a;
}

TEST(FamilyA, DescribesEveryEffectOnce) {
  const std::unique_ptr<Family> family = make_family_a();
  ASSERT_EQ(family->effects().size(), kBlindEffects);
  for (std::size_t k = 0; k < kBlindEffects; ++k) {
    const FamilyEffect& e = family->effects()[k];
    EXPECT_EQ(e.id, effect_names()[k]);
    EXPECT_FALSE(e.channels.empty() || e.regimes.empty() || e.typical.empty()) << e.id;
  }
}

TEST(FamilyA, FliesWhatItsOwnProgramsFly) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Case c = declared_case(assignment().vehicle_file);
  c.seed = 41;
  c.programme = Programme::hover;
  EXPECT_EQ(make_family_a()->fly(assignment(), 1).log, fly(c, 1).log);
}

TEST(FamilyA, DrawsFiguresAndSensorsApart) {
  Assignment a = assignment();
  const Case declared = case_of(a);
  a.own_parameters = true;
  const Case own = case_of(a);
  EXPECT_NE(own.vehicle.left.wing.mass_kg, declared.vehicle.left.wing.mass_kg);
  EXPECT_NE(own.vehicle.left.wing.mass_kg, own.vehicle.right.wing.mass_kg);
  EXPECT_NE(own.vehicle.torso.inertia_kg_m2.xx / declared.vehicle.torso.inertia_kg_m2.xx,
            own.vehicle.torso.inertia_kg_m2.yy / declared.vehicle.torso.inertia_kg_m2.yy);
  EXPECT_NEAR(own.vehicle.torso.mass_kg, declared.vehicle.torso.mass_kg, 0.09 * declared.vehicle.torso.mass_kg);
  EXPECT_EQ(own.sensors->imu, declared.sensors->imu);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    a.seed = seed;
    Case drawn = case_of(a);
    EXPECT_FALSE(model::physical_fault(drawn.vehicle)) << seed;
  }
  a = assignment();
  a.conventions = true;
  const FamilyFlight flight = make_family_a()->fly(a, 0);
  ASSERT_FALSE(flight.crashed) << flight.how;
  const SensorSet sensors = *case_of(a).sensors;
  EXPECT_EQ(flight.log.header.imu.rate_hz, sensors.imu.rate_hz);
  EXPECT_EQ(flight.log.header.imu.latency_s, sensors.imu.latency_s) << "latencies are declared as they are";
  EXPECT_NE(flight.log.header.imu.position_m, sensors.imu.position_m);
  EXPECT_NEAR(static_cast<double>(flight.log.imu.t_s.size()), Family::kFlight_s * sensors.imu.rate_hz, 2);
}

TEST(FamilyA, SaysWhatAnEffectChanges) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::unique_ptr<Family> family = make_family_a();
  const ProposedFlight hover{2,
                             [](double) {
                               return std::array<double, 4>{0, 0, 0.5, 0};
                             },
                             [](double) { return std::array<double, 4>{}; }};
  Assignment a = assignment();
  a.proposed = &hover;
  const Contrast none = family->contrast(a, 0, "mocap_tilt", 1);
  ASSERT_NEAR(static_cast<double>(none.change.size()), 34 * hover.lasts_s, 1);
  EXPECT_NEAR(none.beat_s.front(), 0, 1e-9);
  for (const auto& row : none.change)
    for (const double x : row) ASSERT_EQ(x, 0) << "only a sensor says it";
  // 1e-4 N m about a level axis turns the torso by some tens of rad/s^2, the same in every beat of hover
  const Contrast torque = family->contrast(a, 0, "outside_magnetic_torque", 1);
  const double turning = std::hypot(torque.change[20][15], torque.change[20][20]);
  EXPECT_GT(turning, 10);
  EXPECT_LT(turning, 100);
  EXPECT_NEAR(std::hypot(torque.change[50][15], torque.change[50][20]), turning, 0.2 * turning);
}

}  // namespace
}  // namespace flappy::blind
