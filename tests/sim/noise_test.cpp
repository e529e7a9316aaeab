#include "sim/noise.hpp"

#include <Random123/philox.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "flappy/batch.hpp"
#include "sim/random.hpp"

namespace flappy::sim {

#define FLAPPY_DECLARE_ELEMENTARY(isa)    \
  inline namespace isa {                  \
  std::uint64_t elementary_bits_float();  \
  std::uint64_t elementary_bits_double(); \
  }
FLAPPY_DECLARE_ELEMENTARY(scalar)
FLAPPY_DECLARE_ELEMENTARY(v2)
FLAPPY_DECLARE_ELEMENTARY(v3)
FLAPPY_DECLARE_ELEMENTARY(v4)
FLAPPY_DECLARE_ELEMENTARY(v3_O0)
#undef FLAPPY_DECLARE_ELEMENTARY

namespace {

using model::Lanes;

constexpr std::uint64_t kSeed = 0x0123456789abcdefU;
constexpr auto kImu = static_cast<std::uint32_t>(Stream::imu);

double word_uniform(std::uint32_t w) { return ((w >> 9) + 0.5) * 0x1p-23; }

template <class L>
void expect_philox_words() {
  constexpr int N = sizeof(L) / sizeof(model::Element<L>);
  struct Case {
    std::uint64_t seed;
    std::uint32_t stream, index, flapper, episode;
  };
  for (const Case& c : {Case{0, 0, 0, 0, 0}, Case{~0ULL, ~0U, ~0U, ~0U, ~0U}, Case{kSeed, 2, 3, 4, 5},
                        Case{0xa4093822299f31d0U, 0x85a308d3U, 0x243f6a88U, 0x13198a2eU, 0x03707344U}}) {
    std::uint32_t flapper[N], episode[N];
    for (int i = 0; i < N; ++i) flapper[i] = c.flapper + 7U * i, episode[i] = c.episode - 3U * i;
    const auto u = uniforms<L>(c.seed, c.stream, c.index, flapper, episode);
    for (int i = 0; i < N; ++i) {
      const r123::Philox4x32::ctr_type counter{{c.index, c.stream, flapper[i], episode[i]}};
      const r123::Philox4x32::key_type key{
          {static_cast<std::uint32_t>(c.seed), static_cast<std::uint32_t>(c.seed >> 32)}};
      const auto words = r123::Philox4x32()(counter, key);
      for (int k = 0; k < 4; ++k) EXPECT_EQ(u.u[k].raw[i], word_uniform(words[k])) << N << " lanes, word " << k;
    }
  }
}

// Exactly, in float as in double: both see the same noise.
TEST(Noise, UniformsAreTheWordsOfPhilox) {
  expect_philox_words<Lanes<float, 1>>();
  expect_philox_words<Lanes<float, 4>>();
  expect_philox_words<Lanes<float, 8>>();
  expect_philox_words<Lanes<float, 16>>();
  expect_philox_words<Lanes<double, 1>>();
  expect_philox_words<Lanes<double, 2>>();
  expect_philox_words<Lanes<double, 4>>();
  expect_philox_words<Lanes<double, 8>>();
}

// From uniforms alike to the bit. In h, half an ulp of 1: the logarithm has 4, halved by the root, which adds 1, as does
// the last product: 4 h of the normal; sine and cosine have 2 h of the radius, which is 5.77 at most.
TEST(Noise, NormalsAreThoseOfBoxAndMuller) {
  const auto check = []<class L>(L, double h) {
    using T = model::Element<L>;
    constexpr int N = sizeof(L) / sizeof(T);
    for (std::uint32_t index = 0; index < 20000; ++index) {
      std::uint32_t flapper[N], episode[N];
      for (int i = 0; i < N; ++i) flapper[i] = i, episode[i] = 9;
      const auto u = uniforms<L>(kSeed, kImu, index, flapper, episode);
      const auto n = normals<L>(kSeed, kImu, index, flapper, episode);
      for (int i = 0; i < N; ++i)
        for (int k = 0; k < 4; k += 2) {
          const long double radius = std::sqrt(-2 * std::log(static_cast<long double>(u.u[k].raw[i])));
          const long double angle = std::numbers::pi_v<long double> * (2 * u.u[k + 1].raw[i] - 1);
          ASSERT_LE(std::abs(n.n[k].raw[i] - radius * std::cos(angle)), 6 * h * radius) << index;
          ASSERT_LE(std::abs(n.n[k + 1].raw[i] - radius * std::sin(angle)), 6 * h * radius) << index;
        }
    }
  };
  check(Lanes<float, 4>(), 0x1p-24);
  check(Lanes<double, 2>(), 0x1p-53);
}

constexpr int kLanes = 4;
constexpr std::uint32_t kIndices = 1 << 16;

/// All normals of four neighbouring flappers, one row for each of them and each of the four.
std::vector<std::vector<double>> draw(std::uint64_t seed, std::uint32_t stream, std::uint32_t episode) {
  std::vector<std::vector<double>> rows(4 * kLanes);
  const std::uint32_t flappers[kLanes] = {0, 1, 2, 3}, episodes[kLanes] = {episode, episode, episode, episode};
  for (std::uint32_t index = 0; index < kIndices; ++index) {
    const auto n = normals<Lanes<float, kLanes>>(seed, stream, index, flappers, episodes);
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < kLanes; ++i) rows[k * kLanes + i].push_back(n.n[k].raw[i]);
  }
  return rows;
}

double mean_product(const std::vector<double>& a, const std::vector<double>& b, std::size_t shift = 0) {
  double sum = 0;
  for (std::size_t i = 0; i + shift < a.size(); ++i) sum += a[i] * b[i + shift];
  return sum / static_cast<double>(a.size() - shift);
}

// Of n draws the mean has a standard deviation of 1 / sqrt n, the second moment sqrt(2 / n), the third sqrt(15 / n), the
// fourth sqrt(96 / n), a share p sqrt(p / n). Within five of them, which one in two million would fail.
TEST(Noise, NormalsHaveTheMomentsOfTheLaw) {
  for (const std::vector<double>& row : draw(kSeed, kImu, 1)) {
    double sum[5] = {}, beyond_3 = 0;
    for (const double x : row) {
      double power = 1;
      for (double& s : sum) s += power, power *= x;
      beyond_3 += std::abs(x) > 3;
    }
    const double n = sum[0], share = std::erfc(3 / std::numbers::sqrt2);
    EXPECT_NEAR(sum[1] / n, 0, 5 / std::sqrt(n));
    EXPECT_NEAR(sum[2] / n, 1, 5 * std::sqrt(2 / n));
    EXPECT_NEAR(sum[3] / n, 0, 5 * std::sqrt(15 / n));
    EXPECT_NEAR(sum[4] / n, 3, 5 * std::sqrt(96 / n));
    EXPECT_NEAR(beyond_3 / n, share, 5 * std::sqrt(share / n));
  }
}

// The mean product of independent normals has a standard deviation of 1 / sqrt n, that of their squares less one 2 / sqrt n.
TEST(Noise, NormalsAreIndependent) {
  const auto rows = draw(kSeed, kImu, 1);
  const double limit = 5 / std::sqrt(kIndices);
  const auto squares = [](std::vector<double> row) {
    for (double& x : row) x = x * x - 1;
    return row;
  };
  for (std::size_t a = 0; a < rows.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_NEAR(mean_product(rows[a], rows[b]), 0, limit) << a << " " << b;
      EXPECT_NEAR(mean_product(squares(rows[a]), squares(rows[b])), 0, 2 * limit) << a << " " << b;
    }
    EXPECT_NEAR(mean_product(rows[a], rows[a], 1), 0, limit) << a;
  }
  for (const auto& other :
       {draw(kSeed + 1, kImu, 1), draw(kSeed + (1ULL << 32), kImu, 1), draw(kSeed, kImu + 1, 1), draw(kSeed, kImu, 2)})
    for (std::size_t a = 0; a < rows.size(); ++a) EXPECT_NEAR(mean_product(rows[a], other[a]), 0, limit) << a;
}

// One golden value for every instruction set of this processor, optimised or not. A change of it changes recorded flights.
TEST(Noise, AndElementaryFunctionsHaveTheSameBitsOnAllInstructionSets) {
  struct Set {
    const char* name;
    std::uint64_t (*single)();
    std::uint64_t (*in_double)();
  };
  const auto expect_golden = [](const Set& set) {
    EXPECT_EQ(set.single(), 0x44ee191331f7a188U) << set.name;
    EXPECT_EQ(set.in_double(), 0xcb2a9ce794202fc0U) << set.name;
  };
  const Set sets[] = {{"scalar", scalar::elementary_bits_float, scalar::elementary_bits_double},
                      {"x86-64-v2", v2::elementary_bits_float, v2::elementary_bits_double},
                      {"x86-64-v3", v3::elementary_bits_float, v3::elementary_bits_double},
                      {"x86-64-v4", v4::elementary_bits_float, v4::elementary_bits_double}};
  const std::vector<std::string> names = instruction_sets();
  ASSERT_LE(names.size(), std::size(sets));
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(names[i], sets[i].name);
    expect_golden(sets[i]);
  }
  if (names.size() > 2)
    expect_golden({"x86-64-v3 at -O0", v3_O0::elementary_bits_float, v3_O0::elementary_bits_double});
}

}  // namespace
}  // namespace flappy::sim
