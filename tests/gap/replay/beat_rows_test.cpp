#include "gap/replay/beat_rows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flappy::gap::beat_rows_test {
namespace {

TEST(BeatRows, ProjectAConstantAndItsHarmonics) {
  constexpr std::size_t kBeats = 8, kPerBeat = 15;
  std::vector<double> beat, samples;
  for (std::size_t i = 0; i < kBeats * kPerBeat; ++i) {
    const double b = (static_cast<double>(i) + 0.5) / kPerBeat, a = 2 * std::numbers::pi * b;
    beat.push_back(b);
    samples.push_back(3 + 2 * std::cos(a) - 0.5 * std::sin(3 * a));
  }
  std::vector<char> valid(beat.size(), 1);
  valid[5 * kPerBeat + 7] = 0;
  valid[5 * kPerBeat + 8] = 0;
  const BeatProjection projection(beat, valid, kBeats, 1);
  std::vector<double> rows(kBeats * kCoefficients, 0);
  projection.project(samples.data(), 1, rows.data());
  EXPECT_FALSE(projection.covers(0)) << "left out";
  EXPECT_FALSE(projection.covers(5)) << "two samples of the middle are more than a tenth of its weight";
  ASSERT_TRUE(projection.covers(3));
  const double* r = &rows[std::size_t{3} * kCoefficients];
  const double expected[kCoefficients] = {3, 2, 0, 0, 0, 0, -0.5, 0, 0};
  // over whole samples of a hat, harmonics leak into each other by the square of 1/(2 x 15)
  for (int c = 0; c < kCoefficients; ++c) EXPECT_NEAR(r[c], expected[c], 5e-3) << c;
}

}  // namespace
}  // namespace flappy::gap::beat_rows_test
