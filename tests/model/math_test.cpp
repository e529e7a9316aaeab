#include "model/math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/lanes.hpp"

namespace flappy::model {
namespace {

// Rounding of u = x^2 <= 3.1 (half an ulp, 1.2e-7, times df/du < 0.5), of the polynomial times u (3.1 x 3e-8)
// and of the last sum (3e-8); the same in double.
constexpr double kFloat = 2.2e-7, kDouble = kFloat * 0x1p-29;

TEST(Math, SineAndCosineWithinTheJoints) {
  for (int i = -10000; i <= 10000; ++i) {
    const double x = kLargestAngle_rad * i / 10000;
    EXPECT_NEAR(sin_cos(x).sin, std::sin(x), kDouble);
    EXPECT_NEAR(sin_cos(x).cos, std::cos(x), kDouble);
    const float f = static_cast<float>(x);
    EXPECT_NEAR(sin_cos(f).sin, std::sin(static_cast<double>(f)), kFloat);
    EXPECT_NEAR(sin_cos(f).cos, std::cos(static_cast<double>(f)), kFloat);
  }
}

TEST(Math, CosineOfHalfTurns) {
  for (int i = -1000; i <= 1000; ++i) EXPECT_NEAR(cos_pi(i / 1000.0), std::cos(M_PI * i / 1000.0), 2 * kDouble);
  EXPECT_EQ(cos_pi(0.5), 0);
}

TEST(Math, ExponentialDecays) {
  for (int i = 0; i <= 7000; ++i) {
    const double x = i / 10.0;
    EXPECT_NEAR(exp_negative(x) / std::exp(-x), 1, 4 * kDouble) << x;
  }
  for (int i = 0; i <= 860; ++i) {
    const float x = static_cast<float>(i) / 10;
    EXPECT_NEAR(exp_negative(x) / std::exp(-static_cast<double>(x)), 1, 2 * kFloat) << x;
  }
  EXPECT_EQ(exp_negative(1e9), 0);
  EXPECT_EQ(exp_negative(1e9f), 0);
  EXPECT_EQ(exp_negative(0.0), 1);
}

TEST(Math, Logarithm) {
  std::mt19937_64 engine(1);
  for (int i = 0; i < 20000; ++i) {
    const double x =
        std::ldexp(std::uniform_real_distribution<double>(0.5, 1)(engine), static_cast<int>(engine() % 100) - 60);
    EXPECT_NEAR(log(x), std::log(x), 4.5e-16 * std::max(1.0, std::abs(std::log(x)))) << x;
  }
  EXPECT_EQ(log(1.0), 0);
}

// Lanes are the scalar function in every slot, to the bit, and a product that meets a sum is fused.
TEST(Lanes, AreScalarsInEverySlot) {
  using L = Lanes<float, 4>;
  float x[4] = {0.3f, -1.2f, 1.7f, 0}, out[4];
  sin_cos(L::load(x)).sin.store(out);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(out[i], sin_cos(Lanes<float, 1>(x[i])).sin.raw[0]);
  exp_negative(abs(L::load(x))).store(out);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(out[i], exp_negative(abs(Lanes<float, 1>(x[i]))).raw[0]);
}

TEST(Lanes, FuseWhatIsWritten) {
  using L = Lanes<double, 2>;
  const double a = 1 + 0x1p-30, b = 1 - 0x1p-30;
  EXPECT_EQ(L(L(a) * L(b) - L(1)).raw[1], -0x1p-60);  // fused: the product is not rounded
  EXPECT_EQ(L(L(L(a) * L(b)) - L(1)).raw[1], 0);      // taken as a value first: it is
}

}  // namespace
}  // namespace flappy::model
