#include "gap/fit/screening.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::screening_test {
namespace {

TEST(Screening, StepsAsFarAsVehiclesWithoutTheEffectGo) {
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.background = {{"other", 0.001}, {"spring_hardening", 0.06}, {"ground_effect", 1}};
  const NearSteps near_steps{[&](const std::string& effect) { return discrepancy.background_sd(effect); }, true};
  const sim::Randomisation priors = synthetic_priors();
  const Eigen::VectorXd at = Hypothesis(priors, {}).start();
  for (const MagnitudeStep& s : magnitude_steps(priors, at, {"wind"}, near_steps)) {
    const auto near = [&](std::size_t i, const char* name) {
      return s.near.at(i).vehicle.effects.at(s.effect).at(name);
    };
    EXPECT_NE(s.effect, "wind") << "withheld";
    if (s.effect == "spring_hardening") {
      ASSERT_EQ(s.near.size(), 2u);
      EXPECT_NEAR(near(0, "per_rad2"), 2 * 0.06 * unknowns_of(s.effect)[0].scale, 1e-12);
      EXPECT_NEAR(near(1, "per_rad2"), -near(0, "per_rad2"), 1e-12);
      EXPECT_TRUE(s.further.empty());
    } else if (s.effect == "ground_effect") {
      ASSERT_EQ(s.near.size(), 1u) << "of one sign";
      EXPECT_NEAR(near(0, "gain"), kMagnitudeReach * unknowns_of(s.effect)[0].scale, 1e-12) << "no farther than far";
      EXPECT_GT(s.further.size(), 1u);
      EXPECT_FALSE(s.shaped.empty());
    } else {
      EXPECT_EQ(s.near_reach, 0.05) << s.effect << ": nearer, differences are rough";
    }
  }
  EXPECT_TRUE(magnitude_steps(priors, at, {})[0].near.empty());
}

// Columns of two effects; the flights have a unit of the first, and less than nothing of the second, which has one sign.
TEST(Screening, RanksEffectsByTheirEvidence) {
  const sim::Randomisation priors = synthetic_priors();
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const auto evidence = std::make_shared<const Evidence>(question_of(flights), flights, read_model_discrepancy(), 1);
  const Fitter fitter(question_of(flights), flights, evidence, 1);
  const int velocity = 2, height = 3, large = group_index(kSpecificForceX, 0), lift = group_index(kSpecificForceZ, 0);
  BasisCoefficients wind = BasisCoefficients::Zero(kGroups, evidence->basis().size()), ground = wind, drag = wind;
  wind(large, velocity) = SyntheticFlight::kSignal;
  ground(lift, height) = 0.02;
  drag(large, 1) = SyntheticFlight::kSignal;
  Fit fit;
  fit.at = Eigen::VectorXd(0);
  fit.directions = {Eigen::MatrixXd(0, 0), Eigen::VectorXd(0)};
  Rows zero(made[0]->measured().size(), 0);
  fit.residual = {evidence->without(0, zero, -(1.0 * wind - 0.5 * ground))};
  fit.statistics = evidence->statistics(fit.residual);
  const std::vector<MagnitudeColumn> columns = {{{"ground_effect", 0, 2, true, 0}, ground, {ground}, {}},
                                                {{"body_drag", 0, 1, false, 0}, drag, {drag}, {}},
                                                {{"wind", 0, 5, false, 0}, wind, {wind}, {}}};
  const std::vector<ScreenedEffect> ranking = screen(fitter, fit, columns);
  ASSERT_EQ(ranking.size(), 3u);
  EXPECT_EQ(ranking[0].effect, "wind");
  EXPECT_GT(ranking[0].gain, 20);
  EXPECT_NEAR(ranking[0].coordinates[0], 1, 0.1);
  EXPECT_EQ(ranking[0].coordinates.size(), 5);
  const auto of = [&](const char* effect) { return *std::ranges::find(ranking, effect, &ScreenedEffect::effect); };
  EXPECT_EQ(of("ground_effect").coordinates[0], 0) << "it has one sign";
  EXPECT_LT(of("body_drag").gain, 0.1);
  EXPECT_NEAR(of("body_drag").coordinates[0], 0, 0.1);
  // however much a magnitude of the forbidden sign would gain, it gains nothing
  fit.residual = {evidence->without(0, std::move(zero), 500 * ground)};
  fit.statistics = evidence->statistics(fit.residual);
  MagnitudeColumn two_sided = columns[0];
  two_sided.one_sided = false;
  EXPECT_GT(screen(fitter, fit, {two_sided})[0].gain, 1000);
  EXPECT_LT(screen(fitter, fit, {columns[0]})[0].gain, 1);
}

// A magnitude that does nothing near 0, and turns the rows where it is large: only from there on it is linear.
TEST(Screening, FindsALargeMagnitude) {
  const sim::Randomisation priors = synthetic_priors();
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const auto evidence = std::make_shared<const Evidence>(question_of(flights), flights, read_model_discrepancy(), 1);
  const Fitter fitter(question_of(flights), flights, evidence, 1);
  BasisCoefficients unit = BasisCoefficients::Zero(kGroups, evidence->basis().size());
  unit(group_index(kSpecificForceX, 0), 2) = SyntheticFlight::kSignal;
  Fit fit;
  fit.directions = {Eigen::MatrixXd(0, 0), Eigen::VectorXd(0)};
  Rows zero(made[0]->measured().size(), 0);
  // the change is (m - 1) units beyond a magnitude of 1, and the robot has 1.6
  fit.residual = {evidence->without(0, zero, -0.6 * unit)};
  fit.statistics = evidence->statistics(fit.residual);
  MagnitudeColumn delay{{"command_delay", 0, 1, true, 0}, 1e-5 * unit, {1e-5 * unit}, {}};
  EXPECT_LT(screen(fitter, fit, {delay})[0].gain, 5) << "small steps show next to nothing";
  delay.large.push_back({1.2, 0.2 / 1.2 * unit, unit});
  const ScreenedEffect found = screen(fitter, fit, {delay})[0];
  EXPECT_GT(found.gain, 20);
  EXPECT_NEAR(found.coordinates[0], 1.6, 0.2);
}

}  // namespace
}  // namespace flappy::gap::screening_test
