// Flights of the blind robot: they stay up, their logs read back and pass the check, and the same seed flies the same.
#include "lab/blind/a/flights.hpp"

#include <gtest/gtest.h>

#include "flightlog/check/check.hpp"
#include "full.hpp"
#include "vehicles.hpp"

namespace flappy::blind::flights_test {
namespace {

Case identified(std::uint64_t seed, Programme programme) {
  Case c{.vehicle = test::identified(), .vehicle_file = "hummingbird_identified.toml"};
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  c.seed = seed;
  c.programme = programme;
  c.power = c.wings = true;
  return c;
}

TEST(BlindFlights, PassTheCheckAndReadBack) {
  for (std::size_t k = test::full() ? 0 : 1; k < (test::full() ? kFlights : 2); ++k) {
    const RobotFlight f = fly(identified(1, Programme::rich), k);
    ASSERT_FALSE(f.crashed) << f.how;
    EXPECT_EQ(flightlog::parse_flight_log(flightlog::flight_log_files(f.log), "flight"), f.log);
    const flightlog::CheckReport report = flightlog::check_flight(f.log);
    for (const flightlog::Finding& finding : report.findings)
      EXPECT_NE(finding.verdict, flightlog::Verdict::warning) << k << ": " << finding.check << ": " << finding.text;
    EXPECT_LT(f.farthest_m, 0.15) << k;
    ASSERT_EQ(f.truth.size(), 25u);
    EXPECT_EQ(f.truth[0].size(), 5000u);
    const auto& z = f.truth[3];
    if (k == 1) {  // from near the ground to near the ceiling
      EXPECT_LT(*std::ranges::min_element(z), 0.12);
      EXPECT_GT(*std::ranges::max_element(z), 1.85);
    }
  }
}

TEST(BlindFlights, SameSeedSameBytes) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const ProposedFlight hold{2,
                            [](double) {
                              return std::array<double, 4>{0, 0, 0.5, 0};
                            },
                            [](double) { return std::array<double, 4>{}; }};
  Case c = identified(2, Programme::hover);
  c.proposed = &hold;
  c.magnitudes = Magnitudes({{"wind", 1}, {"command_delay", 0.5}, {"gyro_bias", 1}});
  const RobotFlight a = fly(c, 0), b = fly(c, 0);
  ASSERT_FALSE(a.crashed) << a.how;
  EXPECT_EQ(flightlog::flight_log_files(a.log), flightlog::flight_log_files(b.log));
  EXPECT_EQ(a.truth, b.truth);
  EXPECT_LT(a.farthest_m, 0.1);
  c.seed = 3;
  EXPECT_NE(fly(c, 0).truth, a.truth);
}

// A wall of voltage: it cannot lift itself, and says so.
TEST(BlindFlights, SayWhenTheyCrash) {
  Case c = identified(1, Programme::hover);
  c.vehicle.driver.amplitude_limit_V = 5;
  const RobotFlight f = fly(c, 0);
  EXPECT_TRUE(f.crashed);
  EXPECT_TRUE(f.how.starts_with("touched the ground at -")) << f.how;
}

}  // namespace
}  // namespace flappy::blind::flights_test
