// A robot that drifts from session to session.
#include "gap/session/session_walk.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flappy::gap::session_walk_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const VectorXd kTimes = (VectorXd(5) << 0, 1, 3, 3.5, 7).finished();
const VectorXd kValues = (VectorXd(5) << 0.3, -0.1, 0.4, 0.9, 0.6).finished();

TEST(SessionWalk, IsTheMeanWithoutDrift) {
  const SessionWalk w(kTimes, 30, 0);
  EXPECT_NEAR(w.mean_of_next(kValues), kValues.mean(), 1e-15);
  EXPECT_NEAR(w.sum_of_squares(kValues), (kValues.array() - kValues.mean()).square().sum(), 1e-15);
  EXPECT_NEAR(w.factor_of_next(), 1 + 1.0 / 5, 1e-15);
}

// What is known of one normal variable from others, with a level that may be anything: its variance of 1e7 leaves an
// error of 1e-7. The walk begins anywhere: here far before the first session.
TEST(SessionWalk, IsTheConditionalOfANormalDistribution) {
  constexpr double kWalk = 0.4, kLevel = 1e7, kBefore = -50;
  for (const double at : {-2.0, 3.2, 7.0, 12.0}) {
    SCOPED_TRACE(at);
    VectorXd times(6);
    times << kTimes, at;
    MatrixXd all(6, 6);
    for (Index i = 0; i < 6; ++i)
      for (Index j = 0; j < 6; ++j)
        all(i, j) = kLevel + kWalk * (std::min(times[i], times[j]) - kBefore) + (i == j ? 1 : 0);
    const MatrixXd own = all.topLeftCorner(5, 5);
    const VectorXd with = all.col(5).head(5), weights = own.fullPivLu().solve(with);
    const SessionWalk w(kTimes, at, kWalk);
    EXPECT_NEAR(w.mean_of_next(kValues), weights.dot(kValues), 1e-5);
    EXPECT_NEAR(w.factor_of_next(), all(5, 5) - weights.dot(with), 1e-5);
    EXPECT_NEAR(w.sum_of_squares(kValues), kValues.dot(VectorXd(own.fullPivLu().solve(kValues))), 1e-5);
  }
}

// Long after the last session little is known: the variance grows by the walk.
TEST(SessionWalk, KnowsLessTheLaterItIs) {
  const double soon = SessionWalk(kTimes, 8, 0.4).factor_of_next(),
               late = SessionWalk(kTimes, 108, 0.4).factor_of_next();
  EXPECT_NEAR(late - soon, 0.4 * 100, 1e-9);
}

TEST(SessionTimes, AreTheOrderWithoutDates) {
  EXPECT_EQ(session_numbers({"a", "", "a", "", "b"}), (std::vector<int>{0, 1, 0, 2, 3}));
  const SessionTimes t = session_times({"a", "", "a", "2024-03-05"}, {""});
  EXPECT_EQ(t.references, (VectorXd(3) << 0, 1, 2).finished());
  EXPECT_EQ(t.tests, 3);
}

// References 0, 2 and 4 days after the first, tests 20 and 21 days: two days are the unit. February has 29 days.
TEST(SessionTimes, AreDatesWhereAllHaveSome) {
  const SessionTimes t =
      session_times({"2024-02-27", "logs/2024-02-29 evening", "2024-03-02_b/"}, {"2024-03-18T00:00", "2024-03-19"});
  EXPECT_EQ(t.references, (VectorXd(3) << 0, 1, 2).finished());
  EXPECT_DOUBLE_EQ(t.tests, 10.25);
  const SessionTimes hours = session_times({"2024-03-05T10:00", "2024-03-05T16:00"}, {"2024-03-06T10:00"});
  EXPECT_NEAR(hours.tests, 4, 1e-9);
  // a day is the unit of sessions of one day
  EXPECT_DOUBLE_EQ(session_times({"2024-03-05", "2024-03-05 b"}, {"2024-03-08"}).tests, 3);
  for (const char* none : {"2024-13-05", "2024-3", "march", "20240305", "2024-03-05T25:00", ""})
    EXPECT_EQ(session_times({"2024-03-01", "2024-03-03"}, {none}).tests, 2) << none;
}

}  // namespace
}  // namespace flappy::gap::session_walk_test
