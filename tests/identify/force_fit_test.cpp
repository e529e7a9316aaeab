#include "identify/force_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "full.hpp"
#include "identify/force_sensor.hpp"
#include "identify/linear_map.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify::force_fit_test {
namespace {

const std::vector<std::string> kFour = {"left.motor.resistance_ohm", "right.motor.resistance_ohm",
                                        "left.spring.rest_angle_rad", "right.rotation.upper_rad"};

FitConfig config(const std::vector<std::string>& chosen = {}) {
  return read_fit_config(test::source_path("configs/identify/forces.toml"), test::nominal(), chosen);
}

/// The nominal vehicle with `chosen` as identified.
model::Vehicle changed(const std::vector<std::string>& chosen) {
  model::Vehicle v = test::nominal(), other = test::identified();
  const FitConfig c = config(chosen);
  for (std::size_t i = 0; i < c.parameters.size(); ++i) *fitted_values(c, v)[i] = *fitted_values(c, other)[i];
  return v;
}

/// The last 16 of the default inputs: differences, biases and split cycles at one amplitude.
std::vector<sim::Input> sixteen() {
  const std::vector<sim::Input> all = default_inputs();
  return {all.end() - 16, all.end()};
}

FitOptions one_start() {
  FitOptions o;
  o.starts = 1;
  return o;
}

TEST(ForceFit, ErrorIsAsDefined) {
  // forces of rms 2, torques of rms 3; half of one force and a third of one torque are missed
  const std::vector<Wrench> m = {{2, 2, 2, 3, 3, 3}}, s = {{1, 2, 2, 3, 2, 3}};
  const MapError e = map_error(m, s);
  EXPECT_NEAR(e.total, 100 * std::sqrt((0.25 + 1.0 / 9) / 6), 1e-12);
  EXPECT_EQ(e.rms[0], 1);
  EXPECT_EQ(e.rms[3], 0);
}

TEST(ForceFit, RecoversTwelveWithoutNoise) {
  if (!test::full()) GTEST_SKIP() << "identify_program_test fits them with noise; this takes seconds: with --full";
  const MeasuredMap m = simulate_forces(test::identified(), default_inputs(), {.noise_steps = 0}, 1);
  const ForceFit f = fit_forces(test::nominal(), m, config(), one_start());
  EXPECT_GT(f.before.total, 20);
  EXPECT_LT(f.after.total, 1e-4);
  model::Vehicle truth = test::identified();
  const std::vector<double*> values = fitted_values(config(), truth);
  // the smallest singular value without units is 0.3: what 1e-6 of the map leaves open is 4e-6 of a range, and the map is
  // that smooth
  for (std::size_t i = 0; i < values.size(); ++i) {
    const FittedParameter& p = f.known.parameters[i];
    EXPECT_NEAR(p.value, *values[i], 1e-5 * (p.upper_bound - p.lower_bound)) << p.path;
    EXPECT_TRUE(p.seen);
  }
  EXPECT_TRUE(f.left_out.empty());
}

TEST(ForceFit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  model::Vehicle truth = changed(kFour);
  const FitConfig c = config(kFour);
  const std::vector<double*> values = fitted_values(c, truth);
  std::vector<sim::Input> inputs;  // one block of lanes
  for (std::size_t i = 0; i < 16; i += 2) inputs.push_back(sixteen()[i]);
  int inside = 0, count = 0;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    // from the truth on, which is near the optimum: intervals are about that, wherever a fit came from
    const ForceFit f = fit_forces(truth, simulate_forces(truth, inputs, {}, seed), c, one_start());
    EXPECT_TRUE(f.sd_declared);
    for (std::size_t i = 0; i < values.size(); ++i, ++count) {
      const FittedParameter& p = f.known.parameters[i];
      if (p.low <= *values[i] && *values[i] <= p.high) ++inside;
      const double sd = (p.high - p.low) / (2 * 1.96);
      squares += (p.value - *values[i]) * (p.value - *values[i]) / (sd * sd);
    }
  }
  ASSERT_EQ(count, 60);
  EXPECT_GE(inside, 51);   // 57 +- 1.7; fewer by chance once in 5,000
  EXPECT_GT(squares, 25);  // chi squared of 60: outside by chance once in 10,000 each way
  EXPECT_LT(squares, 107);
}

TEST(ForceFit, EstimatesTheNoiseWhereNoneIsDeclared) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const model::Vehicle truth = changed(kFour);
  MeasuredMap m = simulate_forces(truth, sixteen(), {}, 5);
  const ForceFit declared = fit_forces(test::nominal(), m, config(kFour), one_start());
  m.sd.clear();
  const ForceFit estimated = fit_forces(test::nominal(), m, config(kFour), one_start());
  EXPECT_FALSE(estimated.sd_declared);
  for (std::size_t i = 0; i < kFour.size(); ++i) {
    const FittedParameter &a = declared.known.parameters[i], &b = estimated.known.parameters[i];
    // an sd of 48 values is known to 10 %
    EXPECT_NEAR((b.high - b.low) / (a.high - a.low), 1, 0.3) << a.path;
    EXPECT_NEAR(b.value, a.value, a.high - a.low);
  }
}

TEST(ForceFit, SaysWhatItCannotSee) {
  const model::Vehicle truth = changed(kFour);
  FitConfig c = config(kFour);
  c.parameters.push_back({"left.stroke.upper_rad", 1.5, 1.7});  // no stroke goes there
  const MeasuredMap m = simulate_forces(truth, sixteen(), {}, 6);
  const ForceFit f = fit_forces(test::nominal(), m, c, one_start());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(f.known.parameters[i].seen) << f.known.parameters[i].path;
  EXPECT_FALSE(f.known.parameters[4].seen);
  EXPECT_TRUE(f.known.parameters[4].at_nominal);
  ASSERT_EQ(f.known.weak.size(), 1u);
  ASSERT_EQ(f.known.weak[0].members.size(), 1u);
  EXPECT_EQ(f.known.weak[0].members[0].first, "left.stroke.upper_rad");
  EXPECT_EQ(f.known.parameters[4].value, 1.63);
  EXPECT_EQ(f.vehicle.left.stroke.upper_rad, 1.63);
  EXPECT_LT(f.known.singular_values.back(), 1e-6 * f.known.singular_values.front());
  EXPECT_LT(f.after.total, 0.2);
}

TEST(ForceFit, SaysWhatIsConfounded) {
  // torque per volt is that of constant times efficiency; only the damping, of constant squared, tells them apart
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(13);
  const MeasuredMap m = simulate_forces(test::nominal(), inputs, {}, 7);
  FitConfig c = config({"left.spring.stiffness_positive_Nm_rad", "left.spring.stiffness_negative_Nm_rad"});
  c.parameters.push_back({"left.motor.torque_constant_Nm_A", 1.5e-3, 2e-3});
  c.parameters.push_back({"left.motor.efficiency", 0.7, 1});
  const ForceFit f = fit_forces(test::nominal(), m, c, one_start());
  const auto pair = std::ranges::find_if(f.known.confounded, [](const Confounded& each) {
    return each.first == "left.motor.torque_constant_Nm_A" && each.second == "left.motor.efficiency";
  });
  ASSERT_NE(pair, f.known.confounded.end());
  EXPECT_LT(pair->correlation, -0.9);
  EXPECT_EQ(spring_verdicts(f),
            std::vector<std::string>{"the map does not tell the left spring's two stiffnesses apart"});
}

TEST(ForceFit, SpringVerdicts) {
  const auto verdicts = [](bool negative_seen, bool confounded) {
    ForceFit f;
    for (const char* way : {"positive", "negative"}) {
      FittedParameter p;
      p.path = "right.spring.stiffness_" + std::string(way) + "_Nm_rad";
      p.seen = negative_seen || std::string(way) == "positive";
      f.known.parameters.push_back(p);
    }
    if (confounded) f.known.confounded.push_back({f.known.parameters[0].path, f.known.parameters[1].path, 0.95});
    return spring_verdicts(f);
  };
  using Lines = std::vector<std::string>;
  EXPECT_EQ(verdicts(true, false), Lines{"the map tells the right spring's two stiffnesses apart"});
  EXPECT_EQ(verdicts(false, false), Lines{"the map does not tell the right spring's two stiffnesses apart"});
  EXPECT_EQ(verdicts(true, true), Lines{"the map does not tell the right spring's two stiffnesses apart"});
  EXPECT_EQ(spring_verdicts({}), Lines{});
}

// Amplitude alone, twenty times the noise: six parameters are known from each other alone.
TEST(ForceFit, WhatIsSeenJointlyStaysFitted) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  model::Vehicle truth = test::identified();
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(13);
  const FitConfig c = config();
  const std::vector<double*> values = fitted_values(c, truth);
  const ForceFit f =
      fit_forces(test::nominal(), simulate_forces(truth, inputs, {.noise_steps = 20}, 1), c, one_start());
  // the noise's own error is 2.1 %; all put back at once leave 25 %
  EXPECT_LT(f.after.total, 1.1 * f.stages[0].error);
  EXPECT_LT(f.known.misfit, 1.5);  // 1 +- 0.18
  int seen = 0, back = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const FittedParameter& p = f.known.parameters[i];
    back += p.at_nominal;
    if (p.at_nominal) EXPECT_EQ(p.value, p.nominal) << p.path;
    if (!p.seen) continue;
    ++seen;
    EXPECT_LE(p.low, *values[i]) << p.path;
    EXPECT_GE(p.high, *values[i]) << p.path;
  }
  EXPECT_EQ(seen, 6);
  EXPECT_GE(back, 2);
  EXPECT_LE(back, 5);
}

// Each alone can explain 25 %, both together explain the 36 % that were measured.
TEST(ForceFit, KeepsTheUnseenWhoseNominalValueDoesNotFit) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  model::Vehicle truth = test::nominal();
  truth.left.motor.torque_constant_Nm_A *= 0.8;
  truth.left.motor.efficiency *= 0.8;
  const FitConfig c{{{"left.motor.torque_constant_Nm_A", 1.31e-3, 2.19e-3}, {"left.motor.efficiency", 0.675, 1}}, 0.5};
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(13);
  const ForceFit f =
      fit_forces(test::nominal(), simulate_forces(truth, inputs, {.noise_steps = 200}, 1), c, one_start());
  for (const FittedParameter& p : f.known.parameters) {
    EXPECT_FALSE(p.seen);
    EXPECT_FALSE(p.at_nominal);
    EXPECT_LT(p.value, 0.9 * p.nominal);
  }
  EXPECT_EQ(f.after.total, f.stages[0].error);
}

// Thirteen amplitudes and eight differences see some directions 30 times worse than all 37 inputs: slopes over short steps
// take kinks for knowledge there, and intervals then hold 29 of 48.
TEST(ForceFit, IntervalsHoldTheTruthWhereDirectionsAreWeak) {
  if (!test::full()) GTEST_SKIP() << "two fits of a quarter of a minute: with --full";
  model::Vehicle truth = test::identified();
  std::vector<sim::Input> inputs = default_inputs();
  std::erase_if(inputs, [](const sim::Input& u) { return u.bias_V != 0 || u.split_cycle != 0; });
  ASSERT_EQ(inputs.size(), 21u);
  const FitConfig c = config();
  const std::vector<double*> values = fitted_values(c, truth);
  int inside = 0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const ForceFit f = fit_forces(test::nominal(), simulate_forces(truth, inputs, {}, seed), c, one_start());
    for (std::size_t i = 0; i < values.size(); ++i)
      inside += f.known.parameters[i].low <= *values[i] && *values[i] <= f.known.parameters[i].high;
  }
  EXPECT_GE(inside, 22);  // of 24
}

TEST(ForceFit, LeavesOutWhereTheMapJumps) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const model::Vehicle truth = changed(kFour);
  std::vector<sim::Input> inputs = default_inputs();
  inputs.push_back({2.5, 0, 0, 0});
  const ForceFit f = fit_forces(test::nominal(), simulate_forces(truth, inputs, {}, 8), config(kFour), one_start());
  ASSERT_EQ(f.left_out.size(), 1u);
  EXPECT_EQ(f.left_out[0], 37u);
  EXPECT_TRUE(f.jumping_kept.empty());
  // with as many inputs as parameters it has to stay, and is named
  inputs = {{10, 0, 0, 0}, {10, 1, 0, 0}, {2.5, 0, 0, 0}, {12, 0, 1, 0}};
  const ForceFit few = fit_forces(test::nominal(), simulate_forces(truth, inputs, {}, 8), config(kFour), one_start());
  EXPECT_TRUE(few.left_out.empty());
  EXPECT_EQ(few.jumping_kept, std::vector<std::size_t>{2});
}

TEST(ForceFit, AllMethodsMeet) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::vector<std::string> two(kFour.begin(), kFour.begin() + 2);
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(16);
  const MeasuredMap m = simulate_forces(changed(two), inputs, {}, 9);
  FitOptions o = one_start();
  o.population = 10, o.generations = 6;
  std::vector<ForceFit> fits;
  for (const Method method : {Method::gauss_newton, Method::genetic, Method::cma_es}) {
    o.method = method;
    fits.push_back(fit_forces(test::nominal(), m, config(two), o));
    for (std::size_t i = 0; i < 2; ++i) {
      const FittedParameter &a = fits[0].known.parameters[i], &b = fits.back().known.parameters[i];
      EXPECT_NEAR(b.value, a.value, 0.05 * (a.high - a.low)) << b.path;  // of an interval: the same optimum
    }
  }
  EXPECT_EQ(fits[1].stages.size(), 2u);
  EXPECT_EQ(fits[1].stages[0].evaluations, 70u);
  o.map.threads = 1;
  const ForceFit again = fit_forces(test::nominal(), m, config(two), o);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(again.known.parameters[i].value, fits[2].known.parameters[i].value);
}

TEST(ForceFit, StopsAtOnce) {
  FitOptions o = one_start();
  int calls = 0;
  o.progress = [&](const std::string&, double, double) { return ++calls < 2; };
  EXPECT_TRUE(
      fit_forces(test::nominal(), simulate_forces(test::identified(), default_inputs(), {}, 1), config(), o).stopped);
  EXPECT_EQ(calls, 2);  // no other stage begins
}

TEST(ForceFit, NeedsAsManyInputsAsParameters) {
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(11);
  MeasuredMap m = simulate_forces(test::nominal(), inputs, {}, 1);
  m.name = "m.csv";
  EXPECT_EQ(test::refusal([&] { fit_forces(test::nominal(), m, config()); }),
            "m.csv: has 11 inputs for 12 parameters; accepted: at least as many inputs as parameters");
}

TEST(ForceFit, CountsEachInputOnce) {
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(11);
  inputs.insert(inputs.end(), inputs.begin(), inputs.begin() + 9);
  MeasuredMap m = simulate_forces(test::nominal(), inputs, {}, 1);
  m.name = "m.csv";
  EXPECT_EQ(test::refusal([&] { fit_forces(test::nominal(), m, config()); }),
            "m.csv: has 11 different inputs in 20 rows for 12 parameters; accepted: at least as many inputs as "
            "parameters");
}

TEST(ForceFit, RefusesWhatCannotBeFitted) {
  MeasuredMap m = simulate_forces(test::nominal(), {{10, 0, 0, 0}, {10, 1, 0, 0}}, {}, 1);
  m.name = "m.csv";
  const FitConfig c = config({"left.motor.resistance_ohm"});
  model::Vehicle apart = test::nominal();
  apart.left.spring.stiffness_positive_Nm_rad = apart.left.spring.stiffness_negative_Nm_rad = 1e5;
  EXPECT_EQ(test::refusal([&] { fit_forces(apart, m, c); }),
            "m.csv:2: the vehicle comes apart at (10 V, 0 V, 0 V, 0); accepted: a vehicle that flaps at every input");
  const std::string said = apart.name + ": the vehicle comes apart at (";
  for (const double noise : {0.0, 1.0})
    EXPECT_TRUE(test::refusal([&] { simulate_forces(apart, m.inputs, {.noise_steps = noise}, 1); }).starts_with(said));
  EXPECT_TRUE(test::refusal([&] { linear_map(apart, {}); }).starts_with(said));
  MeasuredMap zero = m;
  for (Wrench& w : zero.wrenches) w[3] = w[4] = w[5] = 0;
  EXPECT_EQ(test::refusal([&] { fit_forces(test::nominal(), zero, c); }),
            "m.csv: all torques are zero; accepted: measured forces and torques");
  for (Wrench& w : m.wrenches) w[0] = w[1] = w[2] = 0;
  EXPECT_EQ(test::refusal([&] { fit_forces(test::nominal(), m, c); }),
            "m.csv: all forces are zero; accepted: measured forces and torques");
}

TEST(ForceFit, KeepsWhereEachStartEnded) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::vector<std::string> two(kFour.begin(), kFour.begin() + 2);
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(16);
  const ForceFit f = fit_forces(test::nominal(), simulate_forces(changed(two), inputs, {}, 9), config(two));
  EXPECT_EQ(f.starts_agreed, 3);
  ASSERT_EQ(f.ends.size(), 3u);
  for (const End& end : f.ends) {
    EXPECT_NEAR(end.cost / f.ends[0].cost, 1, 1e-3);
    EXPECT_LT((end.point - f.ends[0].point).norm(), 1e-3);
  }
  // thrust alone tells neither torques nor side forces apart
  inputs.resize(13);
  const ForceFit g =
      fit_forces(test::nominal(), simulate_forces(changed(two), inputs, {}, 9), config(two), one_start());
  EXPECT_EQ(g.unchecked.size(), 5u);
  EXPECT_TRUE(f.unchecked.size() < 5u);
}

TEST(Intervals, HoldTheEndsThatNoiseDoesNotTellApart) {
  const std::vector<std::string> two(kFour.begin(), kFour.begin() + 2);
  const FitConfig c = config(two);
  const MeasuredMap m = simulate_forces(changed(two), default_inputs(), {}, 9);
  const model::Vehicle nominal = test::nominal();
  const Problem problem(nominal, c, m, {});
  const Eigen::VectorXd point = problem.point(changed(two)), start = problem.point(nominal);
  const Intervals alone = describe(problem, point, start, {});
  // costs as the starts had them do not count: one end is at the optimum, one not 21 above it, one by thousands
  const double far = 3 * (alone.parameters[0].high - alone.parameters[0].low) /
                     (alone.parameters[0].upper_bound - alone.parameters[0].lower_bound);
  const std::vector<End> likely =
      likely_ends(problem, {{1e9, point}, {0, point + Eigen::Vector2d(far, 0)}, {0, start}}, point);
  ASSERT_EQ(likely.size(), 1u);
  EXPECT_EQ(likely[0].point, point);
  const Eigen::VectorXd low = point + Eigen::Vector2d(-0.2, 0.1), high = point + Eigen::Vector2d(0.1, 0.6);
  const Intervals wide = describe(problem, point, start, {{1, low}, {1, high}});
  const auto share = [&](const FittedParameter& p, double value) {
    return (value - p.lower_bound) / (p.upper_bound - p.lower_bound);
  };
  const FittedParameter &p = wide.parameters[0], &q = wide.parameters[1];
  EXPECT_NEAR(share(p, p.low), low[0], 1e-12);
  EXPECT_NEAR(share(p, p.high), high[0], 1e-12);
  EXPECT_TRUE(p.seen);
  EXPECT_EQ(q.low, alone.parameters[1].low);
  EXPECT_NEAR(share(q, q.high), std::min(1.0, high[1]), 1e-12);
  EXPECT_TRUE(alone.parameters[1].seen);
  EXPECT_FALSE(q.seen);
}

TEST(Intervals, AgreementIsMeasuredInNoise) {
  // 95 % quantiles of chi squared of 1 and of 12
  EXPECT_NEAR(explained_by_noise(1, 1), 3.841459, 1e-6);
  EXPECT_NEAR(explained_by_noise(12, 2), 2 * 21.026070, 2e-6);
  EXPECT_EQ(count_agreed({210, 210.5, 213, 220}, 222, 12, true), 3);
  // costs of 1e-4 in units of the map: one more than twice the lowest is no agreement, for all that both are below 1
  EXPECT_EQ(count_agreed({1e-4, 1.002e-4, 2.5e-4}, 222, 12, false), 2);
  EXPECT_EQ(count_agreed({1e-4, 2.5e-4}, 222, 12, true), 2);
  EXPECT_EQ(count_agreed({1e-16, 3e-15}, 222, 12, false), 2);  // both are exact
}

}  // namespace
}  // namespace flappy::identify::force_fit_test
