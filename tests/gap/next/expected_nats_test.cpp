// What a flight is expected to bring, where it can be worked out by hand.
#include "gap/next/expected_nats.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::expected_nats_test {
namespace {

// Along one coefficient of the basis, that a flight tells to a variance v: nats are d^2 / (2 v) for a difference of d, and d^2 / 2 (v + t^2) if the rival
// knows it to a standard deviation of t.
TEST(ExpectedNats, AreThoseOfANormalPredictionInClosedForm) {
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 1);
  const BasisCoefficients none = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  BasisCoefficients unit = none;
  unit(group_index(kSpecificForceX, 1), 2) = 1;
  const auto predicted = [&](double at, std::vector<BasisCoefficients> uncertain) {
    Expected e{evidence.statistics({made[0]->measured()}), std::move(uncertain), none};
    evidence.add(at, unit, e.residual);
    return e;
  };
  const double d = 0.3, certain = expected_nats(evidence, predicted(1, {}), predicted(1 + d, {})),
               v = d * d / (2 * certain);
  EXPECT_GT(certain, 0.1);
  // the difference's own square is found with a ridge (kLooseRidge), those with regressors are not; functions of the basis that
  // look alike in these flights make a few parts in 10000 of it
  const double error = 1e-3 * certain;
  EXPECT_NEAR(expected_nats(evidence, predicted(0, {}), predicted(-2 * d, {})), 4 * certain, 4 * error);
  for (const double t : {0.5 * std::sqrt(v), 3 * std::sqrt(v)}) {
    const Expected a = predicted(1, {t * unit}), b = predicted(1 + d, {t * unit});
    EXPECT_NEAR(expected_nats(evidence, predicted(1, {}), b), d * d / (2 * (v + t * t)), error);
    EXPECT_NEAR(expected_nats(evidence, a, predicted(1 + d, {})), certain, error)
        << "of the truth nothing is uncertain";
    EXPECT_NEAR(expected_nats(evidence, a, a), 0, error);
  }
  Expected lawless = predicted(1 + d, {});
  lawless.law_sd = std::sqrt(v) * unit;
  EXPECT_LT(expected_nats(evidence, predicted(1, {}), lawless), 0.9 * certain);
  EXPECT_NEAR(expected_nats(evidence, lawless, predicted(1, {})), expected_nats(evidence, predicted(1, {}), lawless),
              error);
}

TEST(ExpectedNats, AreOfTheTruthOverEachHypothesis) {
  EXPECT_EQ(expected_nats(Eigen::Vector3d(7, 2, 9), 0), Eigen::Vector3d(0, 5, -2));
}

// D(N) = 1 / (1 + N / 2): 2 nats halve the odds of a rival.
TEST(ExpectedInformation, IsTheMeanGainOfTheTruth) {
  VerdictRule rule = read_verdict_rule();
  rule.tempering.nats = rule.tempering.freedom = 2;
  EXPECT_NEAR(kept_odds(2, rule), 0.5, 1e-15);
  EXPECT_EQ(kept_odds(-1, rule), 1);
  EXPECT_NEAR(expected_information({0.5, 0.5}, {2, 2}, rule), std::log(4.0 / 3), 1e-15);
  EXPECT_NEAR(expected_information({0.5, 0.5}, {2, -3}, rule), std::log(4.0 / 3) / 2, 1e-15);
  EXPECT_NEAR(expected_information({0.2, 0.8}, {1e300, 1e300}, rule), -0.2 * std::log(0.2) - 0.8 * std::log(0.8),
              1e-15);
}

}  // namespace
}  // namespace flappy::gap::expected_nats_test
