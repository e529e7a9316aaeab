#include "gap/session/session_scatter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "vehicles.hpp"

namespace flappy::gap::session_scatter_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::vector<SessionQuantity> kThrust = {{"thrust", "share", "thrust"}};
const std::vector<SessionQuantity> kBoth = {{"thrust", "share", "thrust"}, {"delay", "s", "delay"}};

const SessionPrior& prior() {
  static const SessionPrior read =
      read_session_prior(test::source_path("configs/gap/beat_averaged/session_scatter.toml"));
  return read;
}

SessionValues sessions(const MatrixXd& values) { return {values, MatrixXd::Zero(values.rows(), values.cols())}; }

/// A robot that does not drift.
SessionPrior still() {
  SessionPrior p = prior();
  for (auto& [name, block] : p.blocks) block.drift = 0;
  return p;
}

/// Sessions one after the other, then that of the tests.
SessionTimes in_order(Index n) {
  return {VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)), static_cast<double>(n)};
}

/// Sessions of one quantity.
SessionScatter scatter(const VectorXd& values) { return {kThrust, sessions(values), in_order(values.size()), still()}; }

double density(const SessionScatter& s, double y) {
  return SessionDensity(s, VectorXd::Constant(1, y), VectorXd::Zero(1), prior())
      .log_density(VectorXd::Zero(1), VectorXd::Zero(1));
}

// One session says nothing of its own scatter: the prior's remains. Many say it themselves.
TEST(SessionScatter, LearnsFromTheRobotsOwnSessions) {
  const double before = prior().of(kThrust[0]).scatter;
  EXPECT_NEAR(std::sqrt(scatter(VectorXd::Constant(1, 0.3)).variance()[0]), before, 1e-12);
  VectorXd calm(100), wild(100);
  for (int i = 0; i < 100; ++i) calm[i] = (i % 2 ? 1 : -1) * 1e-3, wild[i] = (i % 2 ? 1 : -1) * 0.1;
  // the variance of the prior, which counts for `freedom` degrees besides 99, adds to that of +-1e-3
  EXPECT_NEAR(std::sqrt(scatter(calm).variance()[0]),
              std::hypot(1e-3, before * std::sqrt(prior().freedom / (prior().freedom + 99))), 1e-4);
  EXPECT_NEAR(std::sqrt(scatter(wild).variance()[0]), 0.1, 2e-3);
}

TEST(SessionScatter, IsAStudentDistribution) {
  VectorXd x(3);
  x << 0.01, 0.02, 0.03;
  const SessionScatter s = scatter(x);
  const double freedom = prior().freedom + 2;
  ASSERT_DOUBLE_EQ(s.freedom(), freedom);
  // its standard deviation over that of the normal distribution of known variance, by the integral over y
  double all = 0, square = 0;
  constexpr double kStep = 1e-4;
  for (double y = -2; y <= 2; y += kStep) {
    const double p = std::exp(density(s, y));
    all += kStep * p, square += kStep * p * (y - 0.02) * (y - 0.02);
  }
  EXPECT_NEAR(all, 1, 1e-4);
  EXPECT_NEAR(square, s.variance()[0] * (1 + 1.0 / 3) * freedom / (freedom - 2), 0.02 * square);
}

TEST(SessionScatter, CapsItsFreedom) { EXPECT_EQ(scatter(VectorXd::Zero(50)).freedom(), prior().most_freedom); }

// The delay may follow a large change of the thrust, for the controller does; it may not change by itself, and the
// thrust does not follow a delay.
TEST(SessionScatter, LetsChangesLeakIntoWhatTheControllerMoves) {
  const SessionScatter s(kBoth, sessions(MatrixXd::Zero(5, 2)), in_order(5), still());
  VectorXd changed(2), shift(2), none = VectorXd::Zero(2);
  changed << 0.15, 0.02;
  shift << 0.15, 0;
  const double with_shift = SessionDensity(s, changed, none, prior()).log_density(shift, none);
  VectorXd alone(2);
  alone << 0, 0.02;
  const double delay_alone = SessionDensity(s, alone, none, prior()).log_density(none, none);
  EXPECT_GT(with_shift, delay_alone + 1);
  VectorXd follows(2), delay(2);
  follows << 0.15, 0.02;
  delay << 0, 0.02;
  EXPECT_LT(SessionDensity(s, follows, none, prior()).log_density(delay, none), with_shift - 5);
}

// The slope of the log density, by differences, is precision times what is left.
TEST(SessionScatter, HasThePrecisionOfItsSlope) {
  const SessionScatter s(kThrust, sessions(MatrixXd::Zero(5, 1)), in_order(5), still());
  const VectorXd none = VectorXd::Zero(1), y = VectorXd::Constant(1, 0.02);
  const SessionDensity d(s, y, none, prior());
  constexpr double kStep = 1e-7;
  const double slope = (d.log_density(VectorXd::Constant(1, kStep), none) - d.log_density(none, none)) / kStep;
  EXPECT_NEAR(d.precision(none, none)[0] * 0.02, slope, 1e-3 * slope);
}

}  // namespace
}  // namespace flappy::gap::session_scatter_test
