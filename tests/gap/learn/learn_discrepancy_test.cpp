#include "gap/learn/learn_discrepancy.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::learn_discrepancy_test {
namespace {

// Robots whose vertical force has, beside the model's, a part that follows the velocity: of each robot another coefficient, drawn with a standard
// deviation of 6 % of the signal. From eight of them the standard deviation is known to a quarter; the forward force, which is alike, takes part.
TEST(LearnDiscrepancy, FindsHowFarModelsAreOff) {
  const sim::Randomisation priors = synthetic_priors();
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0, 0.06 * SyntheticFlight::kSignal);
  std::vector<Flights> robots;
  for (int r = 0; r < 8; ++r) {
    const double off = normal(random);
    const auto flight = std::make_shared<SyntheticFlight>("robot", static_cast<std::uint64_t>(r + 1), synthetic_law);
    flight->fly({synthetic_vehicle()});
    flight->add_measured(kSpecificForceZ, 0, off * flight->velocity);
    robots.push_back({{}, {flight}});
  }
  ModelDiscrepancy start = read_model_discrepancy();
  start.nuisances.clear();
  const ModelDiscrepancy learnt = learn_discrepancy(robots, priors, start, 2);
  const double share = learnt.share(kSpecificForceZ, 0, BasisFunction::velocity_x);
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.12);
  // where models are not off, the least that is learnt, and what like channels have
  EXPECT_LT(learnt.share(kAngularAccelerationY, 1, BasisFunction::velocity_x), 0.5 * share);
  EXPECT_EQ(learnt.spread.robot_sd, start.spread.robot_sd) << "other parameters stay";
  // no robot has an effect: backgrounds become smaller than what was believed, or stay as small
  EXPECT_LE(learnt.background_sd("wind"), std::max(start.background_sd("wind"), 0.3));
}

// Models are off by 6 % of the signal, the same in both sessions of a robot; sessions differ by 1 %.
TEST(LearnSessions, FindsHowMuchLessSessionsDiffer) {
  const sim::Randomisation priors = synthetic_priors();
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal(0, SyntheticFlight::kSignal);
  std::vector<SessionPair> pairs;
  for (int r = 0; r < 8; ++r) {
    const double off = 0.06 * normal(random), changed = 0.01 * normal(random);
    pairs.emplace_back();
    for (int f = 0; f < 2; ++f) {
      const auto flight =
          std::make_shared<SyntheticFlight>("robot", static_cast<std::uint64_t>(2 * r + f + 1), synthetic_law);
      flight->fly({synthetic_vehicle()});
      flight->add_measured(kSpecificForceZ, 0, (off + f * changed) * flight->velocity);
      (f == 0 ? pairs.back().flights.references : pairs.back().flights.tests).push_back(flight);
    }
  }
  ModelDiscrepancy start = read_model_discrepancy();
  start.nuisances.clear();
  start.session = read_session_variation();
  const SessionVariation learnt = learn_sessions(pairs, priors, start, 2);
  const double share = share_of(learnt.shares, kSpecificForceZ, 0, BasisFunction::velocity_x);
  EXPECT_GT(share, 0.004);
  EXPECT_LT(share, 0.02);
  EXPECT_LT(share_of(learnt.shares, kAngularAccelerationY, 1, BasisFunction::velocity_x), 0.5 * share);
  EXPECT_LT(learnt.scale_sd, start.session.scale_sd) << "all pairs differ by as much";
  EXPECT_EQ(learnt.law_error, start.session.law_error) << "no pair has an effect";
}

TEST(LearnLaws, KeepsWhatNoEffectShows) {
  SessionVariation s;
  s.law_error.fill(0.1);
  // two errors of drive at 0.4 count as much as what it had: the mean of the logarithms
  learn_laws({{"command_delay", 0.4}, {"gear_backlash", 0.4}, {"com_offset", 0.2}}, s);
  const auto of = [&](model::Stage stage) { return s.law_error[static_cast<std::size_t>(stage)]; };
  EXPECT_NEAR(of(model::Stage::drive), 0.2, 1e-12);
  EXPECT_NEAR(of(model::Stage::body), 0.1 * std::cbrt(2), 1e-12);
  EXPECT_NEAR(of(model::Stage::air), 0.1, 1e-15);
  EXPECT_NEAR(s.law_most, 2, 1e-12) << "a quantile of 0.4 / 0.2, twice, and 0.2 / 0.126";
  s.law_error.fill(0.1);
  learn_laws({{"command_delay", 0.02}, {"gear_backlash", 0.8}}, s);
  // errors of two: quantiles at 16 and 84 % are at these shares of the way between them
  EXPECT_NEAR(s.law_spread, std::log((0.16 * 0.02 + 0.84 * 0.8) / (0.84 * 0.02 + 0.16 * 0.8)) / 2, 1e-12);
}

}  // namespace
}  // namespace flappy::gap::learn_discrepancy_test
