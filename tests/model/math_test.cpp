#include "model/math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "sim/lanes.hpp"

namespace flappy::model::math_test {
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

// What follows is measured in h, half an ulp of 1, which is the largest relative error of one rounding: for plain numbers
// and for lanes, whose products are fused.
template <class T>
constexpr double kHalfUlp = sizeof(T) == 4 ? 0x1p-24 : 0x1p-53;

float value(float x) { return x; }
double value(double x) { return x; }
template <class T>
T value(const Lanes<T, 1>& x) {
  return x.raw[0];
}

template <class T>
T uniform(std::mt19937_64& engine, double low, double high) {
  return static_cast<T>(low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53));
}
/// Of either sign, with a magnitude between 2^low and 2^high.
template <class T>
T spread(std::mt19937_64& engine, int low, int high) {
  const double power = low + static_cast<double>(engine() % (high - low)), sign = engine() % 2 ? 1 : -1;
  return static_cast<T>(sign * std::ldexp(uniform<double>(engine, 1, 2), static_cast<int>(power)));
}

template <class S>
struct Elementary : testing::Test {
  using Real = Element<S>;
  static constexpr int kDraws = 100000;
  std::mt19937_64 engine{1};
  static constexpr Real kMax = std::numeric_limits<Real>::max(), kMin = std::numeric_limits<Real>::min(),
                        kTiny = std::numeric_limits<Real>::denorm_min(),
                        kInfinity = std::numeric_limits<Real>::infinity(),
                        kNan = std::numeric_limits<Real>::quiet_NaN();
  static constexpr double kPi = static_cast<Real>(std::numbers::pi);

  static void expect_relative(S got, long double want, double roundings, Real at) {
    EXPECT_LE(std::abs(value(got) - want), roundings * kHalfUlp<Real> * std::abs(want)) << at << ": " << value(got);
  }
  static void expect_absolute(S got, long double want, double roundings, Real at) {
    EXPECT_LE(std::abs(value(got) - want), roundings * kHalfUlp<Real>) << at << ": " << value(got);
  }
};
using Kinds = testing::Types<float, double, Lanes<float, 1>, Lanes<double, 1>>;
TYPED_TEST_SUITE(Elementary, Kinds);

// h / 4 from r < 0.35, h from 1 - r, 0.2 h from r^2 e and h from their sum: 2.5 h.
TYPED_TEST(Elementary, Exponential) {
  using T = Element<TypeParam>;
  const double low = sizeof(T) == 4 ? -87 : -708, high = 1 - low;
  for (int i = 0; i < this->kDraws; ++i) {
    const T x = uniform<T>(this->engine, low, high);
    this->expect_relative(exp(TypeParam(x)), std::exp(static_cast<long double>(x)), 2.6, x);
  }
  EXPECT_EQ(value(exp(TypeParam(0))), 1);
  for (const T x : {static_cast<T>(2 * low), -this->kMax, -this->kInfinity}) EXPECT_EQ(value(exp(TypeParam(x))), 0);
  for (const T x : {static_cast<T>(2 * high), this->kMax, this->kInfinity})
    EXPECT_EQ(value(exp(TypeParam(x))), value(exp(TypeParam(high))));
  EXPECT_TRUE(std::isfinite(value(exp(TypeParam(high)))));
  EXPECT_TRUE(std::isnan(value(exp(TypeParam(this->kNan)))));
}

// Every float around where exp(-2 |x|) vanishes beside 1.
TEST(Math, HyperbolicTangentStaysWithinOne) {
  constexpr std::uint32_t kAtOnce = 16;
  float largest = 0;
  for (auto bits = std::bit_cast<std::uint32_t>(7.5F); bits < std::bit_cast<std::uint32_t>(10.0F); bits += kAtOnce) {
    float x[kAtOnce];
    for (std::uint32_t k = 0; k < kAtOnce; ++k) x[k] = std::bit_cast<float>(bits + k);
    const auto y = tanh(Lanes<float, kAtOnce>::load(x));
    for (std::uint32_t k = 0; k < kAtOnce; ++k) largest = std::max(largest, y.raw[k]);
  }
  EXPECT_EQ(largest, 1);
}

// Worst where 2 |x| = 0.35, with exp(-2 |x|) - 1 = q / 2 - 1 / 2 = -0.3: from q 0.5 h and from the sum 0.5 h, 3.3 h in
// relation; the quotient makes 1.2 times that and adds 0.6 h and h.
TYPED_TEST(Elementary, HyperbolicTangent) {
  using T = Element<TypeParam>;
  for (int i = 0; i < this->kDraws; ++i) {
    const T x = i % 2 ? spread<T>(this->engine, -100, 5) : uniform<T>(this->engine, -2, 2);
    this->expect_relative(tanh(TypeParam(x)), std::tanh(static_cast<long double>(x)), 5.6, x);
  }
  EXPECT_EQ(value(tanh(TypeParam(0))), 0);
  for (const T x : {static_cast<T>(20), this->kMax, this->kInfinity}) {
    EXPECT_EQ(value(tanh(TypeParam(x))), 1);
    EXPECT_EQ(value(tanh(TypeParam(-x))), -1);
  }
  EXPECT_TRUE(std::isnan(value(tanh(TypeParam(this->kNan)))));
}

// 2 h from s = (m - 1) / (m + 1) and h from the sum; worst below 1 / sqrt 2, where ln 2 is taken off: 1.2 h of 0.35.
TYPED_TEST(Elementary, Logarithm) {
  using T = Element<TypeParam>;
  for (int i = 0; i < this->kDraws; ++i) {
    const T x = i % 2 ? std::abs(spread<T>(this->engine, -126, 127)) : uniform<T>(this->engine, 0.5, 2);
    this->expect_relative(log(TypeParam(x)), std::log(static_cast<long double>(x)), 4, x);
  }
  for (const T x : {this->kMin, this->kMax, std::nextafter(T(1), T(0)), std::nextafter(T(1), T(2))})
    this->expect_relative(log(TypeParam(x)), std::log(static_cast<long double>(x)), 4, x);
  EXPECT_EQ(value(log(TypeParam(1))), 0);
}

// Worst at tan(pi / 8): 3 h of 0.39 from the quotient, 0.4 h from the polynomial and its sum, 0.4 h from the constant
// pi / 4, 0.5 h from the sum; in relation to 0.39, 6.3 h. The other octants add less than they grow.
TYPED_TEST(Elementary, AngleOfVector) {
  using T = Element<TypeParam>;
  const auto angle = [](T y, T x) { return value(atan2(TypeParam(y), TypeParam(x))); };
  for (int i = 0; i < this->kDraws; ++i) {
    const T x = i % 2 ? spread<T>(this->engine, -30, 30) : uniform<T>(this->engine, -1, 1);
    const T y = i % 2 ? spread<T>(this->engine, -30, 30) : uniform<T>(this->engine, -1, 1);
    const long double want = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    this->expect_relative(atan2(TypeParam(y), TypeParam(x)), want, 6.4, y);
  }
  const double pi = this->kPi, near = 4 * kHalfUlp<T>;
  for (const T zero : {T(0), -T(0)})
    for (const T other : {T(0), -T(0)}) EXPECT_EQ(angle(zero, other), 0);
  for (const T a : {this->kTiny, this->kMin, T(1), this->kMax}) {
    EXPECT_EQ(angle(0, a), 0);
    EXPECT_NEAR(angle(0, -a), pi, near);
    EXPECT_NEAR(angle(a, 0), pi / 2, near);
    EXPECT_NEAR(angle(-a, 0), -pi / 2, near);
    EXPECT_NEAR(angle(a, a), pi / 4, near);
    EXPECT_NEAR(angle(-a, -a), -3 * pi / 4, near);
  }
  EXPECT_NEAR(angle(this->kMax, this->kMax / 2), std::atan(2.0), near);  // no overflow
  EXPECT_NEAR(angle(this->kTiny, -this->kMax), pi, near);
  EXPECT_TRUE(std::isnan(angle(this->kNan, 1)));
  EXPECT_TRUE(std::isnan(angle(1, this->kNan)));
}

// Worst above 1/2: the angle pi / 6 has 1.1 h from the root, the polynomial and its sum; twice that, 0.7 h from the
// constant pi / 2 and 0.5 h from the sum are 6.5 h of 0.52.
TYPED_TEST(Elementary, ArcSine) {
  using T = Element<TypeParam>;
  for (int i = 0; i < this->kDraws; ++i) {
    const T x = i % 2 ? spread<T>(this->engine, -60, 0) : uniform<T>(this->engine, -1, 1);
    this->expect_relative(asin(TypeParam(x)), std::asin(static_cast<long double>(x)), 6.6, x);
  }
  EXPECT_EQ(value(asin(TypeParam(0))), 0);
  for (const T x : {T(1), T(2), this->kMax, this->kInfinity}) {
    EXPECT_EQ(value(asin(TypeParam(x))), static_cast<T>(std::numbers::pi / 2));
    EXPECT_EQ(value(asin(TypeParam(-x))), -static_cast<T>(std::numbers::pi / 2));
  }
  EXPECT_TRUE(std::isnan(value(asin(TypeParam(this->kNan)))));
}

// The angle, at most pi / 4, has 1.2 h from its product with the constant, of which 0.7 remain; 0.5 h come from the
// last sum, 0.2 h from the polynomial and 0.3 h from its argument.
TYPED_TEST(Elementary, SineAndCosineOfHalfTurns) {
  using T = Element<TypeParam>;
  for (int i = -this->kDraws; i <= this->kDraws; ++i) {
    const T x = static_cast<T>(i) / this->kDraws;
    const SinCos<TypeParam> r = sin_cos_pi(TypeParam(x));
    this->expect_absolute(r.sin, std::sin(std::numbers::pi_v<long double> * x), 2, x);
    this->expect_absolute(r.cos, std::cos(std::numbers::pi_v<long double> * x), 2, x);
  }
  for (int quarter = -2; quarter <= 2; ++quarter) {
    const SinCos<TypeParam> r = sin_cos_pi(TypeParam(0.5 * quarter));
    EXPECT_EQ(value(r.sin), quarter % 2);
    EXPECT_EQ(value(r.cos), 1 - std::abs(quarter));
  }
}

// As above, with 0.5 h twice from the reduction.
TYPED_TEST(Elementary, SineAndCosineOfAnyAngle) {
  using T = Element<TypeParam>;
  for (int i = 0; i < this->kDraws; ++i) {
    T x = uniform<T>(this->engine, -1e4, 1e4);
    if (i % 3 == 0) x = static_cast<T>(static_cast<int>(x / 2) * std::numbers::pi / 2);  // where the reduction cancels
    if (i % 3 == 1) x /= 1000;
    const SinCos<TypeParam> r = sin_cos_wide(TypeParam(x));
    this->expect_absolute(r.sin, std::sin(static_cast<long double>(x)), 2, x);
    this->expect_absolute(r.cos, std::cos(static_cast<long double>(x)), 2, x);
  }
  EXPECT_EQ(value(sin_cos_wide(TypeParam(0)).sin), 0);
  EXPECT_EQ(value(sin_cos_wide(TypeParam(0)).cos), 1);
}

TYPED_TEST(Elementary, WordsOnBits) {
  using T = Element<TypeParam>;
  const int largest = std::numeric_limits<T>::max_exponent - 1;
  for (int k = 1 - largest; k <= largest; ++k) {
    const T power = static_cast<T>(std::ldexp(1.0, k)), x = power * T(1.625);
    if (k <= largest - 1) EXPECT_EQ(value(half_to(TypeParam(-k))), power) << k;
    EXPECT_EQ(value(exponent(TypeParam(x))), k);
    EXPECT_EQ(value(mantissa(TypeParam(x))), T(1.625));
    if (k > 1 - largest) EXPECT_EQ(value(exponent(TypeParam(std::nextafter(power, T(0))))), k - 1);
  }
  for (const T x : {T(-2.5), T(-1.5), T(-0.5), T(-0.25), T(0), T(0.5), T(0.75), T(2.5), T(3.5), T(4e6)})
    EXPECT_EQ(value(nearest(TypeParam(x))), std::nearbyint(x));
  EXPECT_EQ(value(copysign(TypeParam(3), TypeParam(-0.0))), -3);
  EXPECT_EQ(value(copysign(TypeParam(-3), TypeParam(2))), 3);
}

/// All functions of one number, for lanes of any width.
template <class L>
std::vector<L> every_function(const L& x) {
  const L one(1), small = L(x * L(0.4));
  return {sin_cos(small).sin,
          sin_cos(small).cos,
          exp_negative(abs(x)),
          exp(x),
          tanh(x),
          log(abs(x)),
          atan2(x, one),
          atan2(one, x),
          atan2(-one, x),
          asin(x),
          sin_cos_pi(small).sin,
          sin_cos_pi(small).cos,
          sin_cos_wide(x).sin,
          sin_cos_wide(x).cos,
          cos_pi(small),
          nearest(x),
          copysign(one, x),
          half_to(nearest(x)),
          exponent(abs(x)),
          mantissa(abs(x))};
}

template <class T, int N>
void expect_scalars_in_every_slot() {
  std::mt19937_64 engine(2);
  for (int i = 0; i < 500; ++i) {
    T x[N], out[N];
    for (T& slot : x) slot = uniform<T>(engine, -2.5, 2.5);
    const auto lanes = every_function(Lanes<T, N>::load(x));
    for (std::size_t f = 0; f < lanes.size(); ++f) {
      lanes[f].store(out);
      for (int slot = 0; slot < N; ++slot)
        ASSERT_EQ(out[slot], value(every_function(Lanes<T, 1>(x[slot]))[f])) << "function " << f << " of " << x[slot];
    }
  }
}

// Lanes are the scalar function in every slot, to the bit.
TEST(Lanes, AreScalarsInEverySlot) {
  expect_scalars_in_every_slot<float, 4>();
  expect_scalars_in_every_slot<float, 8>();
  expect_scalars_in_every_slot<float, 16>();
  expect_scalars_in_every_slot<double, 2>();
  expect_scalars_in_every_slot<double, 4>();
  expect_scalars_in_every_slot<double, 8>();
}

/// -1 below -1, 0 between that and 0, x elsewhere.
template <class L>
__attribute__((noinline)) L stepped_where_negative(L x) {
  const auto negative = x < L(0);
  if (!any(negative)) return x;
  return where(negative & (x < L(-1)), L(-1), where(negative & (x > L(-1)), L(0), x));
}
template <class T, int N>
void expect_steps() {
  for (const double x : {-2.0, -0.5, 0.5}) {
    const Lanes<T, N> got = stepped_where_negative(Lanes<T, N>(x));
    for (int i = 0; i < N; ++i) EXPECT_EQ(got.raw[i], x < -1 ? -1 : x < 0 ? 0 : x) << N << " lanes";
  }
}

// A mask may choose within a branch on it, in one lane too, which no vector unit has.
TEST(Lanes, ChooseInABranchOnTheirMask) {
  expect_steps<float, 1>();
  expect_steps<float, 4>();
  expect_steps<double, 1>();
  expect_steps<double, 2>();
}

// A product that meets a sum is fused.
TEST(Lanes, FuseWhatIsWritten) {
  using L = Lanes<double, 2>;
  const double a = 1 + 0x1p-30, b = 1 - 0x1p-30;
  EXPECT_EQ(L(L(a) * L(b) - L(1)).raw[1], -0x1p-60);  // fused: the product is not rounded
  EXPECT_EQ(L(L(L(a) * L(b)) - L(1)).raw[1], 0);      // taken as a value first: it is
}

}  // namespace
}  // namespace flappy::model::math_test
