#include "flightlog/import/clock.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flappy::flightlog {
namespace {

using Pairs = std::vector<std::pair<std::int64_t, std::int64_t>>;

/// A hundred stamps a second since the sender's start, received by a clock that counts from 1970, is `drift` faster and gets each
/// after at least 200 us, some later by up to 20 ms.
Pairs received(double duration_s, double drift) {
  Pairs pairs;
  std::uint32_t random = 1;
  for (int i = 0; i < 100 * duration_s; ++i) {
    random = 1664525 * random + 1013904223;
    const double late = i == 0 ? 0.01 : std::pow(random / 4294967296.0, 8) * 0.02;
    const std::int64_t stamp = 10'000'000ll * i + 5'000'000'000;
    pairs.emplace_back(
        stamp, 1'760'000'000'123'456'789 + std::llround(1e7 * i * (1 + drift)) + 200'000 + std::llround(1e9 * late));
  }
  return pairs;
}

TEST(ClockLine, FindsTheOffsetBelowDelays) {
  const ClockLine line = ClockLine::below(received(5, 0));
  EXPECT_EQ(line.drift(), 0);
  EXPECT_NEAR(static_cast<double>(line.received_ns(6'000'000'000) - 1'760'000'001'123'656'789), 0, 1e3);
  EXPECT_NEAR(line.offset_s(), 1'759'999'995.123656789, 1e-5);
}

TEST(ClockLine, FindsDriftWhereThereIsTimeEnough) {
  const ClockLine line = ClockLine::below(received(60, 30e-6));
  EXPECT_NEAR(line.drift(), 30e-6, 0.1e-6);
  const std::int64_t last = 5'000'000'000 + 59'000'000'000;
  const std::int64_t truth = 1'760'000'059'123'656'789 + 59'000 * 30;
  EXPECT_NEAR(static_cast<double>(line.received_ns(last) - truth), 0, 3e3);
  EXPECT_EQ(ClockLine::below(received(10, 30e-6)).drift(), 0);
}

TEST(ClockLine, TakesNoJumpForADrift) {
  Pairs pairs = received(60, 0);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].second += 1'000'000'000 * static_cast<std::int64_t>(i / 1000);
  EXPECT_EQ(ClockLine::below(pairs).drift(), 0);
}

TEST(ClockLine, DoesNotMindTheOrderOrOnePair) {
  Pairs pairs = received(30, 30e-6), turned(pairs.rbegin(), pairs.rend());
  turned.push_back(turned.front());
  EXPECT_EQ(ClockLine::below(pairs).received_ns(20'000'000'000), ClockLine::below(turned).received_ns(20'000'000'000));
  EXPECT_EQ(ClockLine::below({{5, 8}}).received_ns(10), 13);
  EXPECT_EQ(ClockLine(7).received_ns(10), 17);
}

}  // namespace
}  // namespace flappy::flightlog
