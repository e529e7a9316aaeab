#include "flightlog/stream_statistics.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace flappy::flightlog::stream_statistics_test {
namespace {

constexpr double kPeriod_s = 0.004;

/// Statistics of those of 3000 samples at 250 Hz that are kept.
StreamStatistics of_kept(const std::function<bool(int)>& keeps) {
  Column t_s;
  for (int i = 0; i < 3000; ++i)
    if (keeps(i)) t_s.push_back(i * kPeriod_s);
  return stream_statistics("s", t_s, 1);
}

std::size_t left_out(const std::function<bool(int)>& keeps) {
  std::size_t count = 0;
  for (int i = 0; i < 3000; ++i) count += !keeps(i);
  return count;
}

// Of 2999 steps, a sample that is missing at an end is none: the rate is then exact, and so is the count.
TEST(StreamStatistics, CountEachGapOnce) {
  std::mt19937 random(1);
  for (const double lost : {0.1, 0.3, 0.42, 0.5}) {
    std::vector<bool> kept(3000, true);
    for (std::size_t i = 1; i < 2999; ++i) kept[i] = std::generate_canonical<double, 32>(random) >= lost;
    const auto keeps = [&](int i) { return kept[static_cast<std::size_t>(i)]; };
    const StreamStatistics s = of_kept(keeps);
    EXPECT_EQ(s.missing, left_out(keeps)) << lost;
    EXPECT_NEAR(s.rate_hz, 250, 1e-9) << lost;
    EXPECT_LT(s.jitter_s, 1e-9) << lost;  // the root of the last digits of its square
  }
}

TEST(StreamStatistics, KnowRegularGapsFromBunches) {
  const auto single = [](int i) { return i % 4 != 1 || i > 2990; };                        // 4 4 8 ms
  const auto side_by_side = [](int i) { return i % 9 != 4 && i % 9 != 6 && i % 9 != 8; };  // 4 4 4 8 8 8 ms
  const auto long_ones = [](int i) { return i % 50 >= 20 || i == 0; };
  EXPECT_EQ(of_kept(single).missing, left_out(single));
  EXPECT_EQ(of_kept(long_ones).missing, left_out(long_ones));
  EXPECT_NEAR(of_kept(single).rate_hz, 250, 1e-9);
  EXPECT_EQ(of_kept(side_by_side).missing, left_out(side_by_side));
  EXPECT_NEAR(of_kept(side_by_side).rate_hz, 250, 1e-9);
}

// 20 of 200 bunches are missing.
TEST(StreamStatistics, KnowBunches) {
  for (const std::size_t size : {2u, 3u, 5u, 8u, 16u})
    for (const double within_s : {1e-5, 3e-4, 1e-3}) {
      Column t_s;
      const double n = static_cast<double>(size);
      for (int bunch = 0; bunch < 200; ++bunch)
        for (std::size_t k = 0; k < size && bunch % 10 != 7; ++k)
          t_s.push_back(bunch * n * kPeriod_s + static_cast<double>(k) * within_s);
      const StreamStatistics s = stream_statistics("s", t_s, 1);
      EXPECT_EQ(s.missing, 20 * size) << size << " " << within_s;
      EXPECT_NEAR(s.rate_hz, 250, 250.0 / 199) << size << " " << within_s;  // the last pause is not in the span
    }
}

TEST(StreamStatistics, TakeLateSamplesForNoGaps) {
  Column t_s;
  for (int i = 0; i < 3000; ++i) t_s.push_back(i * kPeriod_s + (i % 10 == 3 ? 0.9 * kPeriod_s : 0));
  EXPECT_EQ(stream_statistics("s", t_s, 1).missing, 0u);
}

// A third of a period of jitter moves two samples to at most 1.67 periods from each other.
TEST(StreamStatistics, BearJitter) {
  std::mt19937 random(3);
  Column t_s;
  for (int i = 0; i < 3000; ++i)
    t_s.push_back(kPeriod_s * (i + (std::generate_canonical<double, 32>(random) - 0.5) / 3));
  const StreamStatistics s = stream_statistics("s", t_s, 1);
  EXPECT_EQ(s.missing, 0u);
  EXPECT_NEAR(s.rate_hz, 250, 0.05);  // 0.33 periods of 2999
}

// 300 Hz and 400 Hz in stamps of whole milliseconds: 3 3 4 ms, 2 3 ms; ten samples in a row are missing.
TEST(StreamStatistics, TakeStampsOfFewDigits) {
  for (const double rate_hz : {300.0, 400.0}) {
    Column t_s;
    for (int i = 0; i < 3000; ++i)
      if (i < 1000 || i >= 1010) t_s.push_back(1e-3 * std::floor(1e3 * i / rate_hz + 1e-6));
    const StreamStatistics s = stream_statistics("s", t_s, 1);
    EXPECT_EQ(s.missing, 10u) << rate_hz;
    EXPECT_NEAR(s.rate_hz, rate_hz, rate_hz / 3000) << rate_hz;
  }
}

TEST(StreamStatistics, TakeTwoSamples) {
  const StreamStatistics s = stream_statistics("s", {0, 0.5}, 1);
  EXPECT_EQ(s.missing, 0u);
  EXPECT_EQ(s.rate_hz, 2);
  EXPECT_EQ(s.jitter_s, 0);
}

}  // namespace
}  // namespace flappy::flightlog::stream_statistics_test
