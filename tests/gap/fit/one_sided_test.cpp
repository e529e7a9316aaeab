#include "gap/fit/one_sided.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap {
namespace {

class OneSidedTest : public testing::Test {
 protected:
  OneSidedTest() {
    for (Eigen::Index i = hypothesis_.shared(); i < hypothesis_.size(); ++i) {
      const Unknown& u = hypothesis_.unknowns()[static_cast<std::size_t>(i)];
      if (u.magnitude) (u.low >= 0 ? one_sided_ : two_sided_).push_back(i);
    }
  }

  const sim::Randomisation priors_ = synthetic_priors();
  const Hypothesis hypothesis_{priors_, {"wind", "ground_effect", "ceiling_effect"}};
  Eigen::VectorXd mean_ = hypothesis_.start();
  Eigen::MatrixXd covariance_ = Eigen::MatrixXd::Identity(hypothesis_.size(), hypothesis_.size());
  std::vector<Eigen::Index> one_sided_, two_sided_;
};

TEST_F(OneSidedTest, OneMagnitudeIsTruncatedExactly) {
  ASSERT_EQ(one_sided_.size(), 3U);  // the third is uncorrelated with mean 0: a factor 2 x 1/2
  const Eigen::Index i = one_sided_[0], j = one_sided_[1], wind = two_sided_[0];
  mean_[j] += 40;  // surely positive: only the factor 2 of its prior
  covariance_(i, i) = 0.25;
  covariance_(i, wind) = covariance_(wind, i) = 0.3;
  const OneSided s = one_sided(hypothesis_, mean_, covariance_);
  EXPECT_NEAR(s.log_factor, std::log(2.0), 1e-12) << "2 x 1/2 of the one, 2 x 1 of the other";
  const double half_normal = 0.5 * std::sqrt(2 / std::numbers::pi);
  EXPECT_NEAR(s.mean[i] - mean_[i], half_normal, 1e-12);
  EXPECT_NEAR(s.mean[wind] - mean_[wind], 0.3 / 0.25 * half_normal, 1e-12) << "regression on the magnitude";
  EXPECT_EQ(s.mean[j], mean_[j]);
}

// P(both > 0) = 1/4 + asin(rho) / (2 pi) (Sheppard 1899). Keeping the posterior normal errs by at most 0.05 nats here.
TEST_F(OneSidedTest, CorrelatedMagnitudesAgreeWithSheppard) {
  const Eigen::Index i = one_sided_[0], j = one_sided_[1];
  for (const double rho : {-0.8, -0.4, 0.0, 0.4, 0.8}) {
    covariance_(i, j) = covariance_(j, i) = rho;
    const double exact = std::log(4 * (0.25 + std::asin(rho) / (2 * std::numbers::pi)));
    EXPECT_NEAR(one_sided(hypothesis_, mean_, covariance_).log_factor, exact, 0.05) << rho;
  }
}

// The gain of a magnitude that would have to be negative is t^2 / 2 with a normal prior; nearly all of it is taken back.
TEST_F(OneSidedTest, ANegativeMagnitudeGainsNothing) {
  const Eigen::Index i = one_sided_[0];
  mean_[one_sided_[1]] += 40;
  double last = 0;
  for (const double t : {-2.0, -10.0, -14.1, -14.2, -50.0, -1e3}) {
    Eigen::VectorXd mean = mean_;
    mean[i] += t;
    const OneSided s = one_sided(hypothesis_, mean, covariance_);
    const double left = s.log_factor - std::log(2.0) + 0.5 * t * t;
    EXPECT_LT(left, 0);
    EXPECT_NEAR(left, std::log(2 / (-t * std::sqrt(2 * std::numbers::pi))), 1.1 / (t * t)) << t;
    EXPECT_LT(s.log_factor, last);
    EXPECT_NEAR(s.mean[i] - mean_[i], -1 / t, 2.2 / std::pow(-t, 3)) << t;
    last = s.log_factor;
  }
}

// Two magnitudes that are nearly one, both far below 0: the second's variance stays positive on both sides of the series' begin.
TEST_F(OneSidedTest, KeepsVariancesPositive) {
  const Eigen::Index i = one_sided_[0], j = one_sided_[1];
  covariance_(i, j) = covariance_(j, i) = 0.999;
  for (const double t : {-14.1, -14.2, -60.0}) {
    Eigen::VectorXd mean = mean_;
    mean[i] += t, mean[j] += 0.99 * t;
    const OneSided s = one_sided(hypothesis_, mean, covariance_);
    EXPECT_TRUE(std::isfinite(s.log_factor) && s.mean.allFinite()) << t;
  }
}

}  // namespace
}  // namespace flappy::gap
