#include "gap/fit/hypothesis.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::hypothesis_test {
namespace {

TEST(Hypothesis, HasTheVehiclesParametersThenTheLagThenTheEffects) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis h(priors, {"wind", "mocap_tilt"});
  EXPECT_EQ(h.parameters(), 1) << "the minor draw is none";
  EXPECT_EQ(h.unknowns()[0].name, "torso.mass_kg");
  EXPECT_EQ(h.unknowns()[1].name, "imu.latency_s");
  EXPECT_EQ(h.shared(), 2);
  EXPECT_EQ(h.unknowns()[2].effect, "wind");
  EXPECT_EQ(h.unknowns()[2].name, "x_m_s");
  EXPECT_TRUE(h.unknowns()[2].magnitude);
  EXPECT_FALSE(h.unknowns()[2].in_log);
  // of the tether's like: magnitudes first, then shape parameters
  const std::vector<Unknown> wind = unknowns_of("wind");
  EXPECT_EQ(wind.back().name, "gust_time_s");
  EXPECT_FALSE(wind.back().magnitude);
  EXPECT_TRUE(h.unknowns().back().in_log) << "a sensor's";
}

TEST(Hypothesis, HasCoordinatesThatAreStandardNormalAPriori) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis h(priors, {"wind"});
  Eigen::VectorXd at = h.start();
  EXPECT_EQ(h.vehicle(at).vehicle.effects.at("wind").at("x_m_s"), 0);
  EXPECT_DOUBLE_EQ(h.vehicle(at).vehicle.effects.at("wind").at("gust_time_s"), 0.5) << "the middle of its prior";
  at[0] = 2;
  at[1] = 1;
  at[2] = 1.645;
  const VehicleHypothesis v = h.vehicle(at);
  EXPECT_NEAR(v.vehicle.torso.mass_kg / synthetic_vehicle().torso.mass_kg, 1.2, 1e-12);
  EXPECT_NEAR(v.lag_s, 5e-4, 1e-15);
  EXPECT_NEAR(v.vehicle.effects.at("wind").at("x_m_s"), 0.9, 1e-12) << "90 % of the prior lie within 1.645 sd";
  EXPECT_NEAR(h.start(v.vehicle)[2], 1.645, 1e-12);
  // a minor draw moves what no coordinate does
  const VehicleHypothesis moved = h.vehicle(h.start(), std::pair{std::size_t{1}, 1.0});
  EXPECT_NEAR(moved.vehicle.torso.com_m.x - synthetic_vehicle().torso.com_m.x, 0.001, 1e-12);
}

TEST(Hypothesis, KeepsCoordinatesInTheAcceptedRanges) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis h(priors, {"ground_effect"});
  Eigen::VectorXd at = h.start();
  at[0] = 9;
  at[2] = -1;
  const Eigen::VectorXd bounded = h.bounded(at);
  EXPECT_EQ(bounded[0], 4);
  EXPECT_EQ(bounded[2], 0) << "the gain has one sign";
  EXPECT_EQ(bounded[1], at[1]);
}

}  // namespace
}  // namespace flappy::gap::hypothesis_test
