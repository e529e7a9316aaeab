#include "io/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace flappy::io {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Quantile, IsOfTypeSeven) {
  // h = 1 + 9 x 0.25 = 3.25: a quarter of the way from 3 to 4; types 4, 5, 6 and 8 give 2.5, 3, 2.75 and 2.9167
  EXPECT_DOUBLE_EQ(quantile({7, 3, 1, 10, 5, 2, 9, 4, 8, 6}, 0.25), 3.25);
  EXPECT_DOUBLE_EQ(quantile({1, 11}, 0.9), 10);
  EXPECT_EQ(quantile({3, 1, 2}, 0), 1);
  EXPECT_EQ(quantile({3, 1, 2}, 1), 3);
  EXPECT_EQ(quantile({5}, 0.95), 5);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
}

TEST(Quantile, IsANumberBesideInfiniteOnes) {
  EXPECT_EQ(quantile({kInfinite, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantile({kInfinite, 1, 2}, 0.75), kInfinite);
  EXPECT_EQ(median({kInfinite, kInfinite, 1, kInfinite}), kInfinite);
  EXPECT_EQ(median({-kInfinite, -kInfinite, 1, 1}), -kInfinite);
}

TEST(Quantile, OfNothingIsNone) {
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_TRUE(std::isnan(upper_median({})));
  EXPECT_TRUE(std::isnan(order_statistic({1, 2}, 2)));
}

TEST(OrderStatistic, IsAValueOfTheSample) {
  EXPECT_EQ(order_statistic({3, 1, 2}, 0), 1);
  EXPECT_EQ(order_statistic({3, 1, 2}, 2), 3);
  EXPECT_EQ(upper_median({4, 1, 2, 3}), 3);
  EXPECT_EQ(upper_median({3, 1, 2}), 2);
}

TEST(WilsonInterval, IsThatOfTheLiterature) {
  // Newcombe, Stat. Med. 17, 1998, table I, method 3
  const auto expect = [](std::size_t successes, std::size_t count, double low, double high) {
    const Interval interval = wilson_interval(successes, count);
    EXPECT_NEAR(interval.low, low, 5e-5) << successes;
    EXPECT_NEAR(interval.high, high, 5e-5) << successes;
  };
  expect(81, 263, 0.2553, 0.3662);
  expect(15, 148, 0.0624, 0.1605);
  expect(1, 29, 0.0061, 0.1718);
  EXPECT_NEAR(wilson_interval(0, 20).high, 0.1611, 5e-5);
  for (std::size_t count = 1; count < 50; ++count) {
    EXPECT_EQ(wilson_interval(0, count).low, 0) << "exactly, for " << count;
    EXPECT_EQ(wilson_interval(count, count).high, 1) << "exactly, for " << count;
  }
  EXPECT_EQ(wilson_interval(0, 0).low, 0);
  EXPECT_EQ(wilson_interval(0, 0).high, 1);
}

TEST(Tails, AreThoseOfTables) {
  // printed tables: t 0.975 of 10 and of 3, F 0.95 of (5, 12), chi squared 0.95 of 6 and of 7
  EXPECT_NEAR(t_tail(2.228139, 10), 0.05, 1e-6);
  EXPECT_NEAR(t_tail(-3.182446, 3), 0.05, 1e-6);
  EXPECT_NEAR(f_tail(3.105875, 5, 12), 0.05, 1e-6);
  EXPECT_NEAR(chi2_tail(12.591587, 6), 0.05, 1e-6);
  EXPECT_NEAR(chi2_tail(14.067140, 7), 0.05, 1e-6);
  EXPECT_NEAR(chi2_quantile(0.95, 7), 14.067140, 1e-6);
  EXPECT_NEAR(chi2_quantile(0.95, 1), kNormal975 * kNormal975, 1e-12);
}

TEST(Tails, KeepTheirEnds) {
  EXPECT_EQ(t_tail(0, 5), 1);
  EXPECT_EQ(t_tail(kInfinite, 5), 0);
  EXPECT_EQ(f_tail(-1, 2, 3), 1);
  EXPECT_EQ(f_tail(kInfinite, 2, 3), 0);
  EXPECT_EQ(f_tail(std::nan(""), 2, 3), 1) << "what cannot be told is no discovery";
  EXPECT_EQ(chi2_tail(-1, 4), 1);
  // far out, where 1 - P would be rounding: exp(-x/2) of two degrees of freedom
  EXPECT_NEAR(chi2_tail(200, 2) / std::exp(-100.0), 1, 1e-12);
}

}  // namespace
}  // namespace flappy::io
