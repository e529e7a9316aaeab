// The scales that make flights most probable.
#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::weigh_test {
namespace {

/// Statistics of a residual that is a smooth function and nothing else.
SufficientStatistics statistics_of(const Evidence& evidence, const Flights& flights, const BasisCoefficients& delta) {
  Residuals zero;
  for (const auto& f : flights.all()) zero.emplace_back(f->beats() * kRowsPerBeat, 0.0);
  SufficientStatistics s = evidence.statistics(zero);
  evidence.add(1, delta, s);
  return s;
}

class Weigh : public testing::Test {
 protected:
  std::vector<std::shared_ptr<SyntheticFlight>> made_ = synthetic_flights(1, synthetic_law);
  Flights flights_ = as_flights(made_);
};

// Discrepancy coefficients drawn at three times their prior standard deviation, and in one block at ninety times: the robot's scale is three. The
// block is free where that is allowed: its scale costs more than the penalty of 10 nats, nu / 2 (2 log 30 - 1) with nu = 4.
TEST_F(Weigh, FindsHowFarModelsOfARobotAreOff) {
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.spread.place_freedom = discrepancy.spread.block_freedom;
  const Evidence evidence(question_of(flights_), flights_, discrepancy, 1);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const int freed = evidence.block_of(group_index(kSpecificForceZ, 0), 1);
  BasisCoefficients delta = evidence.discrepancy_sd({});
  for (int g = 0; g < kGroups; ++g)
    for (int i = 0; i < evidence.basis().size(); ++i)
      delta(g, i) *= (evidence.block_of(g, i) == freed ? 90 : 3) * normal(random);
  const SufficientStatistics s = statistics_of(evidence, flights_, delta);
  const auto weigh = [&](std::optional<double> penalty, int iterations) {
    return evidence.weigh(s, {}, {1}, {}, Scales{}, penalty, iterations);
  };
  const ScaledEvidence w = weigh({}, Evidence::kMaxIterations);
  // some forty coefficients in six groups: 1 / sqrt(2 x 40) of the log, and heavy tails draw it in
  EXPECT_NEAR(std::log(w.scales.robot), std::log(3), 0.5);
  EXPECT_GT(w.scales.blocks[static_cast<std::size_t>(freed)], 4 * w.scales.robot);
  double before = -1e300;
  for (const int n : {1, 2, 4, Evidence::kMaxIterations}) {
    const double now = weigh({}, n).posterior.log_evidence;
    EXPECT_GE(now, before) << n << " iterations: it never falls";
    before = now;
  }
  const ScaledEvidence freer = weigh(10, Evidence::kMaxIterations);
  EXPECT_EQ(std::count(freer.scales.free.begin(), freer.scales.free.end(), 1), 1);
  EXPECT_TRUE(freer.scales.free[static_cast<std::size_t>(freed)]);
  EXPECT_GT(freer.posterior.log_evidence, w.posterior.log_evidence);
  // where blocks of the place have lighter tails, the heavy ones of this block hold it already
  discrepancy.spread.place_freedom = 2 * discrepancy.spread.block_freedom;
  const ScaledEvidence held = evidence.with_discrepancy(discrepancy).weigh(s, {}, {1}, {}, Scales{}, 10);
  EXPECT_EQ(std::count(held.scales.free.begin(), held.scales.free.end(), 1), 0);
}

// A background magnitude of twenty times its prior, in rows that show it to a hundredth: its scale t has the largest
//   log N(20; 0, t^2) + nu / 2 (2 log(f / t) + 1 - f^2 / t^2)      at t^2 = (20^2 + nu f^2) / (1 + nu)
// and costs the second term.
TEST_F(Weigh, FindsALargeBackgroundMagnitude) {
  const Evidence evidence(question_of(flights_), flights_, read_model_discrepancy(), 1);
  const int group = group_index(kSpecificForceX, 0);
  BasisCoefficients column = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  column(group, 0) = 1;
  const double sum = statistics_of(evidence, flights_, column).sums[0][static_cast<std::size_t>(group)][0];
  column *= 100 * std::hypot(evidence.discrepancy_sd({})(group, 0), 1 / std::sqrt(sum));
  constexpr double kTimes = 20, kFreedom = 7;
  const SufficientStatistics s = statistics_of(evidence, flights_, kTimes * column);
  const ScalePrior of_robot{kFreedom, true}, of_none{kFreedom, false};
  Regressors background, fixed;
  background.add(column, 0, 0, of_robot);
  fixed.add(column, 0);
  const ScaledEvidence w = evidence.weigh(s, background, {1}, {}, Scales{});
  const double f = w.scales.robot, nu = kFreedom, t2 = (kTimes * kTimes + nu * f * f) / (1 + nu);
  ASSERT_EQ(w.scales.effects.size(), 1u);
  EXPECT_NEAR(w.scales.effects[0] / std::sqrt(t2), 1, 0.03);
  // a regressor without a scale has sd 1: twenty of these are improbable by 200 nats
  const ScaledEvidence unscaled = evidence.weigh(s, fixed, {1}, {}, Scales{});
  const double by_scale =
      -0.5 * kTimes * kTimes / t2 - 0.5 * std::log(t2) + nu / 2 * (std::log(f * f / t2) + 1 - f * f / t2);
  const double gain = by_scale + 0.5 * kTimes * kTimes;
  EXPECT_NEAR((w.posterior.log_evidence - unscaled.posterior.log_evidence) / gain, 1, 0.1)
      << "the robot's scale and its blocks move along";
  EXPECT_NEAR(Evidence::scale_cost_nats(10, of_robot, {}), nu / 2 * (2 * std::log(10) - 1 + 0.01), 1e-12);
  Scales far;
  far.robot = 5;
  EXPECT_EQ(Evidence::scale_cost_nats(5, of_robot, far), 0);
  EXPECT_EQ(Evidence::scale_cost_nats(1, of_none, far), 0) << "about 1, however far models of the robot are off";
}

// What the laws of effects get wrong takes part in the variance, and no scale changes it.
TEST_F(Weigh, TakesWhatLawsGetWrong) {
  const Evidence evidence(question_of(flights_), flights_, read_model_discrepancy(), 1);
  const int group = group_index(kSpecificForceZ, 0);
  BasisCoefficients delta = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  delta(group, 3) = 30 * evidence.discrepancy_sd({})(group, 3);
  const SufficientStatistics s = statistics_of(evidence, flights_, delta);
  const ScaledEvidence without = evidence.weigh(s, {}, {1}, {}, Scales{});
  const ScaledEvidence with = evidence.weigh(s, {}, {1}, delta.cwiseAbs(), Scales{});
  EXPECT_GT(with.posterior.log_evidence, without.posterior.log_evidence + 5);
  EXPECT_LT(with.scales.blocks[static_cast<std::size_t>(evidence.block_of(group, 3))],
            without.scales.blocks[static_cast<std::size_t>(evidence.block_of(group, 3))]);
}

// With all scales 1 the evidence is that of the closed form, and the prior of the scales costs nothing.
TEST_F(Weigh, CostsNothingWhereAllScalesAreOne) {
  const Evidence evidence(question_of(flights_), flights_, read_model_discrepancy(), 1);
  BasisCoefficients unit = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  unit(group_index(kSpecificForceX, 1), 2) = 1;
  Regressors one;
  one.add(unit, 0.7);
  const SufficientStatistics s = evidence.statistics({made_[0]->measured()});
  const double closed =
      Evidence::posterior(evidence.reduce(s, one.columns, {1}, evidence.discrepancy_sd({})), one.all, one.prior_mean())
          .log_evidence;
  EXPECT_NEAR(evidence.weigh(s, one, {1}, {}, Scales{}, {}, 1).posterior.log_evidence, closed,
              1e-11 * std::abs(closed));
}

// Of three flights the second is higher and shows a tenth of the signal more, as a warm sensor does: that is an offset of the flight, and no
// block of the place is free.
TEST(WeighFlights, WhatChangesFromFlightToFlightIsNoPlace) {
  Flights flights;
  for (int f = 0; f < 3; ++f)
    flights.tests.push_back(
        std::make_shared<SyntheticFlight>("f" + std::to_string(f), f + 1, synthetic_law, f == 1 ? 3 : 0));
  const Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 1);
  const std::size_t group = static_cast<std::size_t>(group_index(kSpecificForceX, 1));
  Residuals residual;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    Rows rows(flights[f]->beats() * kRowsPerBeat, 0);
    for (std::size_t j = 0; f == 1 && j < flights[f]->beats(); ++j)
      rows[j * kRowsPerBeat + group] = 0.1 * SyntheticFlight::kSignal;
    residual.push_back(std::move(rows));
  }
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  BasisCoefficients delta = evidence.discrepancy_sd({});
  for (double& d : delta.reshaped()) d *= normal(random);
  SufficientStatistics s = evidence.statistics(residual);
  evidence.add(1, delta, s);
  const ScaledEvidence w = evidence.weigh(s, {}, {1, 1, 1}, {}, Scales{}, 10);
  for (std::size_t b = 0; b < kBlocks; ++b)
    EXPECT_FALSE(w.scales.free[b] && b % kClasses == static_cast<std::size_t>(Regimes::place)) << b;
}

}  // namespace
}  // namespace flappy::gap::weigh_test
