#include "identify/force_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "identify/fit_config.hpp"
#include "identify/force_sensor.hpp"
#include "identify/linear_map.hpp"
#include "vehicles.hpp"

namespace flappy::identify::force_map_test {
namespace {

/// Largest difference of a value, over the root mean square of `b`'s forces or torques.
double worst(const std::vector<Wrench>& a, const std::vector<Wrench>& b) {
  double sum[2] = {0, 0}, most = 0;
  for (const Wrench& w : b)
    for (std::size_t k = 0; k < kChannels; ++k) sum[k / 3] += w[k] * w[k] / (3.0 * static_cast<double>(b.size()));
  for (std::size_t i = 0; i < b.size(); ++i)
    for (std::size_t k = 0; k < kChannels; ++k)
      most = std::max(most, std::abs(a[i][k] - b[i][k]) / std::sqrt(sum[k / 3]));
  return most;
}

/// The shipped vehicles, then others within the bounds of a fit.
std::vector<model::Vehicle> vehicles(int others) {
  std::vector<model::Vehicle> list = {test::nominal(), test::identified()};
  const FitConfig config = read_fit_config(test::source_path("configs/identify/forces.toml"), list[0]);
  std::mt19937 generator(1);  // NOLINT(bugprone-random-generator-seed,cert-msc51-cpp): the same vehicles every time
  for (int i = 0; i < others; ++i) {
    model::Vehicle v = test::nominal();
    const std::vector<double*> values = fitted_values(config, v);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const FitParameter& p = config.parameters[k];
      *values[k] = p.low + (p.high - p.low) * (static_cast<double>(generator()) * 0x1p-32);
    }
    list.push_back(v);
  }
  return list;
}

TEST(ForceMap, IsPeriodicOnceSettled) {
  const std::vector<model::Vehicle> some = vehicles(6);
  const std::vector<sim::Input> inputs = default_inputs();
  const auto once = force_map<double>(some, inputs),
             twice = force_map<double>(some, inputs, {.settle_s = 2 * kSettle_s});
  EXPECT_LT(worst(once, twice), 1e-3);  // 2e-4 is seen
  EXPECT_GT(worst(force_map<double>(some, inputs, {.settle_s = 0.02}), twice), 1e-3) << "wings settle at once?";
}

TEST(ForceMap, AveragesWholeBeats) {
  model::Vehicle v = test::nominal();
  const Window usual = whole_beats(v.driver);
  EXPECT_EQ(usual.beats, 17);
  EXPECT_EQ(usual.steps, 5000);
  v.driver.flapping_Hz = 33.7;  // 337 beats are 10 s: the first whole number of holds
  const std::vector<sim::Input> inputs = {{10, 0, 0, 0}, {10, 1, 1, 0.05}};
  auto batch = welded_batch<double>(std::span(&v, 1), inputs, {});
  batch.step(settle_steps(v.driver, kSettle_s));
  std::vector<sim::HeldImpulse> before;
  for (std::size_t i = 0; i < inputs.size(); ++i) before.push_back(batch.held_impulse(i));
  batch.step(100000);
  std::vector<Wrench> exact;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    exact.push_back(mean_wrench(before[i], batch.held_impulse(i), 10, {}));
  // half a step of 3,000 at least, of a wrench that swings by about three times the mean, and the holds left over
  EXPECT_LT(worst(force_map<double>(std::span(&v, 1), inputs), exact), 2e-3);
}

TEST(ForceMap, TorquesAreAboutTheirPoint) {
  const model::Vehicle v = test::identified();
  const std::vector<sim::Input> inputs = {{10, 1, 1, 0.05}};
  const Wrench o = force_map<double>(std::span(&v, 1), inputs)[0];
  const Wrench p = force_map<double>(std::span(&v, 1), inputs, {.moment_point_m = {0.01, 0.02, 0.03}})[0];
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(p[k], o[k]);
  // M_P = M_O + (O - P) x F
  EXPECT_NEAR(p[3], o[3] + (-0.02 * o[2] + 0.03 * o[1]), 1e-15);
  EXPECT_NEAR(p[4], o[4] + (-0.03 * o[0] + 0.01 * o[2]), 1e-15);
  EXPECT_NEAR(p[5], o[5] + (-0.01 * o[1] + 0.02 * o[0]), 1e-15);
  // 10.9067 g of torso, 0.7081 g and 0.0626 g at each shoulder
  const model::Triple com = centre_of_mass(test::nominal());
  EXPECT_NEAR(com.x, 0.12517e-3, 1e-8);
  EXPECT_NEAR(com.y, 0.0007e-3, 1e-8);
  EXPECT_NEAR(com.z, 0.29773e-3, 1e-8);
}

TEST(ForceMap, AgreesWithOtherEngines) {
  const model::Vehicle v = test::nominal();
  const std::vector<sim::Input> inputs = {{10, 0, 0, 0}};
  // converged mean thrust at 10 V; 100 us are within 0.1 % of it (docs/results/accuracy.md)
  EXPECT_NEAR(force_map<double>(std::span(&v, 1), inputs)[0][2], 0.1258, 2e-4);
  // slopes of DART at 20 us, whose joint springs lose some percent of thrust to numerical damping
  const LinearMap map = linear_map(v, {.moment_point_m = centre_of_mass(v)});
  EXPECT_NEAR(map[1].slope / 1.053e-3, 1, 0.02);
  EXPECT_NEAR(map[2].slope / 0.579e-3, 1, 0.02);
  EXPECT_NEAR(map[3].slope / 3.85e-3, 1, 0.02);
  const LinearMap published = read_published_map(test::source_path("configs/identify/published_map.toml"));
  EXPECT_NEAR(-published[0].offset / published[0].slope, 2.5115, 1e-9);
}

TEST(ForceMap, SameBytesWhateverStepsIt) {
  const std::vector<model::Vehicle> some = vehicles(1);
  const std::vector<sim::Input> inputs = default_inputs();
  const auto all = force_map<float>(some, inputs, {.threads = 2});
  EXPECT_EQ(all, force_map<float>(some, inputs, {.threads = 1}));
  EXPECT_EQ(all, force_map<float>(some, inputs, {.threads = 3, .instruction_set = "x86-64-v2"}));
  const std::vector<Wrench> last(all.end() - static_cast<std::ptrdiff_t>(inputs.size()), all.end());
  EXPECT_EQ(last, force_map<float>(std::span(&some.back(), 1), inputs));
  EXPECT_LT(worst(all, force_map<double>(some, inputs)), 1e-3);
}

TEST(ForceSensor, ScattersAsItDeclares) {
  const model::Vehicle v = test::identified();
  const std::vector<sim::Input> inputs = default_inputs();
  const MeasuredMap exact = simulate_forces(v, inputs, {.noise_steps = 0}, 1);
  EXPECT_EQ(exact.wrenches, force_map<double>(std::span(&v, 1), inputs));
  EXPECT_TRUE(exact.sd.empty());
  const MeasuredMap noisy = simulate_forces(v, inputs, {}, 1),
                    again = simulate_forces(v, inputs, {}, 1, {.threads = 1});
  EXPECT_EQ(noisy.wrenches, again.wrenches);
  EXPECT_NE(noisy.wrenches, simulate_forces(v, inputs, {}, 2).wrenches);
  // one step and its rounding, over 2,500 samples
  EXPECT_NEAR(noisy.sd[0][0], std::sqrt(13.0 / 12) / 320 / 50, 1e-12);
  double sum[2] = {0, 0};
  for (std::size_t i = 0; i < inputs.size(); ++i)
    for (std::size_t k = 0; k < kChannels; ++k) {
      const double z = (noisy.wrenches[i][k] - exact.wrenches[i][k]) / noisy.sd[i][k];
      sum[k / 3] += z * z / (3.0 * static_cast<double>(inputs.size()));
    }
  // a mean of 111 squares of normal numbers: 1 +- 0.13
  EXPECT_NEAR(sum[0], 1, 0.5);
  EXPECT_NEAR(sum[1], 1, 0.5);
}

}  // namespace
}  // namespace flappy::identify::force_map_test
