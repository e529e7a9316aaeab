// Where the gap lies and how far it shrinks, on rows whose truth is known.
#include "gap/localise/where.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "gap/localise/closure.hpp"
#include "gap/localise/ladder.hpp"
#include "gap/localise/significance.hpp"

namespace flappy::gap {
namespace {

// ---- tests for noise

TEST(Significance, DiscoveriesAreThoseOfBenjaminiAndHochberg) {
  // the example of their paper, 1995, section 3.2: four discoveries at 0.05
  const std::vector<double> p = {0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344,
                                 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0000};
  const std::vector<char> found = discoveries(p, 0.05);
  EXPECT_EQ(found, (std::vector<char>{1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  // a late one that passes takes the earlier ones along
  EXPECT_EQ(discoveries({0.04, 0.03}, 0.05), (std::vector<char>{1, 1}));
  EXPECT_EQ(discoveries({0.04, 0.9}, 0.05), (std::vector<char>{0, 0}));
}

/// Noise that remembers the beat before, of sd 1.
std::vector<double> remembering(std::mt19937_64& random, std::size_t n, double past) {
  std::normal_distribution<double> normal;
  std::vector<double> y = {normal(random)};
  while (y.size() < n) y.push_back(past * y.back() + std::sqrt(1 - past * past) * normal(random));
  return y;
}

TEST(Significance, BlocksKeepTheirFalseAlarmsOnNoiseThatRemembers) {
  constexpr int kTrials = 1000;
  for (const double past : {0.0, 0.5, 0.8}) {
    std::mt19937_64 random(7);
    int mean = 0, slope = 0, naive = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<double> y, x;
      const std::vector<std::size_t> beats = {340, 340, 340};
      for (const std::size_t n : beats) {
        const std::vector<double> one = remembering(random, n, past), input = remembering(random, n, 0.9);
        y.insert(y.end(), one.begin(), one.end());
        x.insert(x.end(), input.begin(), input.end());
      }
      // a third of the beats, by what is slow itself
      std::vector<double> third;
      for (const double v : x) third.push_back(v > 0.43 ? 1 : 0);
      const std::vector<int> block = blocks_of(beats, 16), single = blocks_of(beats, 1);
      mean += slope_test(third, y, block)->p_value < 0.05;
      slope += slope_test(x, y, block)->p_value < 0.05;
      double sum = 0;
      for (const double v : y) sum += v;
      naive += std::abs(sum) / std::sqrt(static_cast<double>(y.size())) > 1.96;
    }
    // binomial: 5 % +- 0.7 %. What two blocks apart still share, and variances of some sixty blocks that are spread unevenly,
    // may add as much again; counting beats as independent raises a quarter of false alarms at 0.5
    EXPECT_LT(mean, 0.085 * kTrials) << past;
    EXPECT_GT(mean, 0.015 * kTrials) << past;
    EXPECT_LT(slope, 0.085 * kTrials) << past;
    EXPECT_GT(slope, 0.015 * kTrials) << past;
    if (past > 0.4) EXPECT_GT(naive, 0.2 * kTrials);
  }
  // a single short flight: what few blocks hold is not told, or not overrated
  std::mt19937_64 random(8);
  int found = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<double> y = remembering(random, 140, 0.3), x = remembering(random, 140, 0.95);
    std::vector<double> third;
    for (const double v : x) third.push_back(v > 0.43 ? 1 : 0);
    const auto s = slope_test(third, y, blocks_of({140}, 16));
    found += s && s->p_value < 0.01;
  }
  EXPECT_LT(found, 0.03 * kTrials);
}

TEST(Significance, SeesAMeanAndASlope) {
  std::mt19937_64 random(3);
  const std::vector<std::size_t> beats = {500, 500};
  const std::vector<int> block = blocks_of(beats, 16);
  std::vector<double> y = remembering(random, 1000, 0.5), x = remembering(random, 1000, 0.9);
  const std::vector<double> all(1000, 1);
  // its sd is sqrt(3 / 1000) = 0.055, so 0.5 is nine of them
  std::vector<double> moved = y, tilted = y;
  for (std::size_t i = 0; i < y.size(); ++i) moved[i] += 0.5, tilted[i] += 0.5 * x[i];
  EXPECT_NEAR(slope_test(all, moved, block)->slope, 0.5, 0.25);
  EXPECT_LT(slope_test(all, moved, block)->p_value, 1e-5);
  EXPECT_NEAR(slope_test(x, tilted, block)->slope, 0.5, 0.25);
  EXPECT_LT(slope_test(x, tilted, block)->p_value, 1e-5);
  EXPECT_FALSE(slope_test(std::vector<double>(1000, 0), y, block));
  EXPECT_FALSE(slope_test(std::vector<double>(70, 1), std::vector<double>(y.begin(), y.begin() + 70), block))
      << "four blocks and a bit";
  // flights do not touch: the last block of one and the first of the next
  EXPECT_GT(block[500], block[499] + kWhitenessLags);
}

TEST(Significance, WhitenessIsOfBlocks) {
  const std::vector<std::size_t> beats = {500, 500};
  const std::vector<int> block = blocks_of(beats, 8);
  std::mt19937_64 random(5);
  int false_alarms = 0;
  for (int trial = 0; trial < 500; ++trial)
    false_alarms += whiteness_test(remembering(random, 1000, 0.2), block)->p_value < 0.05;
  EXPECT_LT(false_alarms, 45) << "25 expected, sd 5, and some more for what neighbours share";
  EXPECT_GT(false_alarms, 8);
  // a slow wave under the noise: 16 blocks a period
  std::vector<double> y = remembering(random, 1000, 0.2);
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += std::sin(2 * M_PI * static_cast<double>(i) / 128);
  EXPECT_LT(whiteness_test(y, block)->p_value, 1e-6);
  EXPECT_FALSE(whiteness_test(std::vector<double>(100, 1.0), std::vector<int>(100, 1)));
}

TEST(Significance, BandsAddUpToTheSumOfSquares) {
  std::mt19937_64 random(1);
  std::vector<double> y = remembering(random, 341, 0.3);
  double mean = 0, squares = 0;
  for (const double v : y) mean += v / static_cast<double>(y.size());
  for (const double v : y) squares += (v - mean) * (v - mean);
  Bands b;
  add_bands(y, 34, {1, 4, 17}, b);
  EXPECT_NEAR(b.power[0] + b.power[1] + b.power[2], squares, 1e-9 * squares);
  EXPECT_EQ(b.bins[0] + b.bins[1] + b.bins[2], 170u);
  // a wave of 2 Hz and amplitude 3 is in its band alone
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = 3 * std::sin(2 * M_PI * 20 * static_cast<double>(i) / 341);
  Bands wave;
  add_bands(y, 34, {1, 4, 17}, wave);
  EXPECT_NEAR(wave.power[1], 341 * 4.5, 1e-6);
  EXPECT_NEAR(wave.power[0] + wave.power[2], 0, 1e-6);
}

// ---- where

/// Three flights of noise of sd 2 in every row, remembered as given, sorted by one quantity and driven by one input.
struct Flown {
  RowContext around;
  Residuals residual;
};
Flown flown(unsigned seed, double past) {
  constexpr std::size_t kBeats = 340;
  std::mt19937_64 random(seed);
  Flown f;
  f.around.noise_sd.assign(kGroups, 2);
  for (int g = 0; g < static_cast<int>(kRowsPerBeat); ++g)
    f.around.rows.push_back(g / kCoefficients < kPathX || g % kCoefficients == 0 ? 1 : 0);
  Quantity height{"height", "m", {}}, input{"input", "V", {}};
  const auto rows = [&] {
    Rows r(kBeats * kRowsPerBeat, 0);
    for (int g = 0; g < static_cast<int>(kRowsPerBeat); ++g) {
      const std::vector<double> y = remembering(random, kBeats, past);
      for (std::size_t j = 0; j < kBeats; ++j) r[j * kRowsPerBeat + static_cast<std::size_t>(g)] = 2 * y[j];
    }
    return r;
  };
  for (int flight = 0; flight < 3; ++flight) {
    f.around.beats.push_back(kBeats);
    f.around.beats_Hz.push_back(34);
    f.around.clamped.push_back(0);
    f.around.covered.emplace_back(kBeats * kChannels, 1);
    height.values.push_back(remembering(random, kBeats, 0.95));
    input.values.push_back(remembering(random, kBeats, 0.8));
    f.residual.push_back(rows());
  }
  f.around.regimes = {height};
  f.around.inputs = {input};
  return f;
}

const ResidualLocation& place(const std::vector<ResidualLocation>& places, ResidualTest test, int channel,
                              const std::string& regime) {
  for (const ResidualLocation& p : places)
    if (p.test == test && p.channel == channel_name(channel) && text_of(p.regime, test).starts_with(regime)) return p;
  ADD_FAILURE() << name_of(test) << " " << regime;
  return places.front();
}

TEST(Where, FindsNothingInNoise) {
  int found = 0;
  std::map<ResidualTest, std::pair<double, double>> low;  // p below 0.05, of all
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Flown f = flown(seed, 0.3);
    for (const ResidualLocation& p : locate(f.around, f.residual, Fitted::refit)) {
      found += p.discovered;
      low[p.test].first += p.p_value < 0.05;
      low[p.test].second += 1;
    }
  }
  // of 160 whiteness tests and 280 and more of each other kind: 5 % +- 2 % and 1.3 %, as above some more
  for (const auto& [test, n] : low) EXPECT_LT(n.first, 0.1 * n.second) << name_of(test);
  EXPECT_EQ(low.size(), 6u);
  // without a gap any discovery is false: one table in twenty may have some, and the tests are within a few percent of exact
  EXPECT_LE(found, 4);
}

TEST(Ladder, CountsEachRungAgainstItsNoise) {
  Flown f = flown(1, 0.3);
  f.around.clamped[1] = 1;
  for (std::size_t i = 0; i < f.residual[1].size(); ++i)
    if (i % kRowsPerBeat < group_of(kStrokeLeft, 0)) f.residual[1][i] *= 5;
  TestResiduals none = f.residual;
  none[2].clear();
  RankedHypothesis spring, both;
  spring.effects = {"spring_hardening"}, spring.probability = 0.6;
  both.effects = {"wing_damage", "gyro_bias"}, both.probability = 0.3;
  const std::vector<LadderRung> ladder = ladder_of(f.around, none, f.residual, nullptr, {spring, both});
  ASSERT_EQ(ladder.size(), 3u);
  EXPECT_NEAR(*ladder[0].refit, 1, 0.05) << "wings and motors, of all flights";
  // path and rotate of a clamped robot have no rows in truth; here they are noise of six rows beside 54 of five times
  EXPECT_NEAR(*ladder[1].refit, std::sqrt((54 * 25 + 6) / 60.0), 0.1);
  EXPECT_NEAR(*ladder[2].refit, 1, 0.05);
  EXPECT_FALSE(ladder[0].nominal) << "it diverged";
  EXPECT_FALSE(ladder[0].effect) << "not fitted";
  EXPECT_EQ(ladder[0].probability, 0.6);
  EXPECT_EQ(ladder[1].probability, 0.3) << "wing_damage";
  EXPECT_EQ(ladder[2].probability, 0.3) << "gyro_bias";
  // without film and currents
  for (const int channel :
       {kStrokeLeft, kStrokeRight, kRotationLeft, kRotationRight, kBattery, kCurrentLeft, kCurrentRight})
    for (int c = 0; c < kCoefficients; ++c) f.around.rows[group_of(channel, c)] = 0;
  EXPECT_FALSE(ladder_of(f.around, none, f.residual, nullptr, {})[0].refit);
}

TEST(Ladder, AnEffectActsOnTheRungWhereAClampedRobotShowsIt) {
  for (const char* effect : {"gear_backlash", "stop_compliance", "battery_sag", "wing_inertia"})
    EXPECT_EQ(rung_of_effect(effect), 0u) << effect;
  for (const char* effect : {"rotational_lift", "wing_damage", "clap_and_fling"})
    EXPECT_EQ(rung_of_effect(effect), 1u) << effect;
  for (const char* effect : {"com_offset", "tether", "wind", "ground_effect", "mocap_delay"})
    EXPECT_EQ(rung_of_effect(effect), 2u) << effect;
}

TEST(Where, FindsWhatDependsOnHeight) {
  Flown f = flown(1, 0.3);
  const auto low = [&](std::size_t flight, std::size_t j) { return f.around.regimes[0].values[flight][j] < -0.43; };
  for (std::size_t flight = 0; flight < 3; ++flight)
    for (std::size_t j = 0; j < 340; ++j)
      if (low(flight, j)) f.residual[flight][j * kRowsPerBeat + group_of(kSpecificForceZ, 0)] += 6;
  const std::vector<ResidualLocation> places = locate(f.around, f.residual, Fitted::refit);
  const ResidualLocation& below = place(places, ResidualTest::regime, kSpecificForceZ, "height below");
  EXPECT_TRUE(below.discovered);
  EXPECT_LT(below.p_value, 1e-5);
  // noise in all nine coefficients: 4 (1 + 8/2); 36 of the offset beside
  EXPECT_DOUBLE_EQ(below.noise_floor, std::sqrt(20));
  EXPECT_NEAR(below.gap, std::sqrt(56), 0.6);
  EXPECT_FALSE(place(places, ResidualTest::regime, kSpecificForceZ, "height above").discovered);
  EXPECT_FALSE(place(places, ResidualTest::regime, kSpecificForceX, "height below").discovered);
  EXPECT_TRUE(place(places, ResidualTest::phase, kSpecificForceZ, "mean").discovered);
  EXPECT_FALSE(place(places, ResidualTest::phase, kSpecificForceZ, "harmonic 2").discovered);
  // height changes over some twenty beats: slowly
  EXPECT_TRUE(place(places, ResidualTest::frequency, kSpecificForceZ, "0 to 0.5 Hz").discovered);
  EXPECT_FALSE(place(places, ResidualTest::frequency, kSpecificForceX, "0 to 0.5 Hz").discovered);
  EXPECT_TRUE(place(places, ResidualTest::whiteness, kSpecificForceZ, "means").discovered);
  EXPECT_FALSE(place(places, ResidualTest::whiteness, kSpecificForceY, "means").discovered);
}

TEST(Where, FindsWhatFollowsAnInput) {
  Flown f = flown(2, 0.3);
  for (std::size_t flight = 0; flight < 3; ++flight)
    for (std::size_t j = 0; j < 340; ++j)
      f.residual[flight][j * kRowsPerBeat + group_of(kAngularAccelerationY, 1)] += f.around.inputs[0].values[flight][j];
  const std::vector<ResidualLocation> places = locate(f.around, f.residual, Fitted::refit);
  const ResidualLocation& p = place(places, ResidualTest::input, kAngularAccelerationY, "input");
  EXPECT_TRUE(p.discovered);
  EXPECT_NEAR(p.gap, std::sqrt(0.5), 0.2) << "a cosine of amplitude 1 and input of rms 1";
  EXPECT_FALSE(place(places, ResidualTest::input, kAngularAccelerationX, "input").discovered);
}

TEST(Where, LeavesOutWhatIsNotCovered) {
  Flown f = flown(1, 0);
  for (auto& covered : f.around.covered)
    for (std::size_t j = 0; j < 340; ++j) covered[j * kChannels + kStrokeLeft] = 0;
  for (const ResidualLocation& p : locate(f.around, f.residual, Fitted::refit))
    EXPECT_NE(p.channel, channel_name(kStrokeLeft));
  f.residual[1].clear();
  EXPECT_FALSE(locate(f.around, f.residual, Fitted::refit).empty()) << "a vehicle that came apart in one flight";
}

// ---- how far

TEST(Closure, TheFloorIsTheLossOfNormalNoise) {
  // by the trapezoidal rule, whose error is far below that of the sum
  double sum = 0;
  for (int i = -10000; i <= 10000; ++i) {
    const double z = i * 1e-3;
    sum += 1e-3 * huber_loss(z) * std::exp(-z * z / 2) / std::sqrt(2 * M_PI);
  }
  EXPECT_NEAR(huber_floor(), sum, 1e-7);
  EXPECT_DOUBLE_EQ(huber_loss(1), 0.5);
  EXPECT_DOUBLE_EQ(huber_loss(-3), kHuber * 3 - kHuber * kHuber / 2);
}

TEST(Closure, LossesOfNoiseAreTheFloor) {
  const Flown f = flown(3, 0);
  const Losses l = losses_of(f.around, f.residual);
  // half of 1.2e5 rows are of nine coefficients; the loss of one has sd 0.55, so the mean 0.003
  EXPECT_NEAR(*l.mean(), huber_floor(), 0.01);
  EXPECT_EQ(l.sum.size(), 3u * 43u) << "blocks do not cross flights";
  Residuals apart = f.residual;
  apart[2].clear();
  EXPECT_FALSE(losses_of(f.around, apart).mean());
}

TEST(Closure, LossesOfFlightsAndOfABenchAreApart) {
  Flown f = flown(3, 0);
  EXPECT_FALSE(losses_of(f.around, f.residual).mean(true)) << "there is no bench";
  f.around.clamped[2] = 1;
  for (double& r : f.residual[2]) r *= 5;
  const Losses l = losses_of(f.around, f.residual);
  EXPECT_NEAR(*l.mean(false), huber_floor(), 0.015);
  EXPECT_GT(*l.mean(true), 4 * huber_floor());
}

/// Blocks whose mean loss scatters by the given sd.
Losses losses(double mean, double sd, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Losses l;
  for (int i = 0; i < 100; ++i) l.sum.push_back(100 * (mean + sd * normal(random))), l.count.push_back(100);
  return l;
}

TEST(Closure, IsTheShareOfTheGapThatVanished) {
  const std::optional<Closure> c = closure_of(losses(1.5, 0.1, 1), losses(0.7, 0.1, 2), 0.5);
  ASSERT_TRUE(c);
  // sd of a mean: 0.01, so of the share about 0.01
  EXPECT_NEAR(c->value, 0.8, 0.05);
  EXPECT_LT(c->low, c->value);
  EXPECT_GT(c->high, c->value);
  // 90 % of a share that varies by 0.01 x sqrt(1 + 0.2^2) on either side, 1.645 times
  EXPECT_NEAR(c->high - c->low, 2 * 1.645 * 0.0102, 0.01);
  // what drops below the floor closes more than all
  EXPECT_GT(closure_of(losses(1.5, 0.1, 1), losses(0.4, 0.1, 2), 0.5)->value, 1);
}

TEST(Closure, IsNullWhereThereIsNoGap) {
  const Losses refit = losses(0.5, 0.1, 1);
  const double mean = *refit.mean();  // with an sd of 0.01
  EXPECT_FALSE(closure_of(refit, refit, mean - 0.015));
  EXPECT_TRUE(closure_of(refit, refit, mean - 0.03));
  EXPECT_FALSE(closure_of(refit, refit, mean + 0.03)) << "below the floor";
  EXPECT_FALSE(closure_of(refit, {}, mean - 0.1)) << "came apart";
}

}  // namespace
}  // namespace flappy::gap
