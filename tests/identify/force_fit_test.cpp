#include "identify/force_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "identify/force_sensor.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify {
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
  const MeasuredMap m = simulate_forces(test::identified(), default_inputs(), {.noise_steps = 0}, 1);
  const ForceFit f = fit_forces(test::nominal(), m, config(), one_start());
  EXPECT_GT(f.before.total, 20);
  EXPECT_LT(f.after.total, 1e-4);
  model::Vehicle truth = test::identified();
  const std::vector<double*> values = fitted_values(config(), truth);
  // the smallest singular value without units is 0.3: what 1e-6 of the map leaves open is 4e-6 of a range, and the map is
  // that smooth
  for (std::size_t i = 0; i < values.size(); ++i) {
    const FittedParameter& p = f.parameters[i];
    EXPECT_NEAR(p.value, *values[i], 1e-5 * (p.upper_bound - p.lower_bound)) << p.path;
    EXPECT_TRUE(p.seen);
  }
  EXPECT_TRUE(f.left_out.empty());
}

TEST(ForceFit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  model::Vehicle truth = changed(kFour);
  const FitConfig c = config(kFour);
  const std::vector<double*> values = fitted_values(c, truth);
  std::vector<sim::Input> inputs = default_inputs();
  inputs.erase(inputs.begin(), inputs.begin() + 21);
  int inside = 0, count = 0;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    const ForceFit f = fit_forces(test::nominal(), simulate_forces(truth, inputs, {}, seed), c, one_start());
    EXPECT_TRUE(f.sd_declared);
    for (std::size_t i = 0; i < values.size(); ++i, ++count) {
      const FittedParameter& p = f.parameters[i];
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
  const model::Vehicle truth = changed(kFour);
  MeasuredMap m = simulate_forces(truth, default_inputs(), {}, 5);
  const ForceFit declared = fit_forces(test::nominal(), m, config(kFour), one_start());
  m.sd.clear();
  const ForceFit estimated = fit_forces(test::nominal(), m, config(kFour), one_start());
  EXPECT_FALSE(estimated.sd_declared);
  for (std::size_t i = 0; i < kFour.size(); ++i) {
    const FittedParameter &a = declared.parameters[i], &b = estimated.parameters[i];
    // an sd of 111 values is known to 7 %
    EXPECT_NEAR((b.high - b.low) / (a.high - a.low), 1, 0.3) << a.path;
    EXPECT_NEAR(b.value, a.value, a.high - a.low);
  }
}

TEST(ForceFit, SaysWhatItCannotSee) {
  const model::Vehicle truth = changed(kFour);
  FitConfig c = config(kFour);
  c.parameters.push_back({"left.stroke.upper_rad", 1.5, 1.7});  // no stroke goes there
  const MeasuredMap m = simulate_forces(truth, default_inputs(), {}, 6);
  const ForceFit f = fit_forces(test::nominal(), m, c, one_start());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(f.parameters[i].seen) << f.parameters[i].path;
  EXPECT_FALSE(f.parameters[4].seen);
  EXPECT_EQ(f.parameters[4].value, 1.63);
  EXPECT_EQ(f.vehicle.left.stroke.upper_rad, 1.63);
  EXPECT_LT(f.singular_values.back(), 1e-6 * f.singular_values.front());
  EXPECT_LT(f.after.total, 0.2);
}

TEST(ForceFit, SaysWhatIsConfounded) {
  // air and both motors scale a symmetric map of thrust alike
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(13);
  const MeasuredMap m = simulate_forces(test::nominal(), inputs, {}, 7);
  FitConfig c = config({"left.spring.stiffness_positive_Nm_rad", "left.spring.stiffness_negative_Nm_rad"});
  c.parameters.push_back({"left.motor.torque_constant_Nm_A", 1.5e-3, 2e-3});
  c.parameters.push_back({"left.motor.efficiency", 0.7, 1});
  const ForceFit f = fit_forces(test::nominal(), m, c, one_start());
  bool found = false;
  for (const Confounded& pair : f.confounded)
    found |= pair.first == "left.motor.torque_constant_Nm_A" && pair.second == "left.motor.efficiency";
  EXPECT_TRUE(found);
  EXPECT_EQ(spring_verdicts(f).size(), 1u);
}

TEST(ForceFit, LeavesOutWhereTheMapJumps) {
  const model::Vehicle truth = changed(kFour);
  std::vector<sim::Input> inputs = default_inputs();
  inputs.push_back({2.5, 0, 0, 0});
  const ForceFit f = fit_forces(test::nominal(), simulate_forces(truth, inputs, {}, 8), config(kFour), one_start());
  ASSERT_EQ(f.left_out.size(), 1u);
  EXPECT_EQ(f.left_out[0].amplitude_V, 2.5);
}

TEST(ForceFit, AllMethodsMeet) {
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
      const FittedParameter &a = fits[0].parameters[i], &b = fits.back().parameters[i];
      EXPECT_NEAR(b.value, a.value, 0.05 * (a.high - a.low)) << b.path;  // of an interval: the same optimum
    }
  }
  EXPECT_EQ(fits[1].stages.size(), 2u);
  EXPECT_EQ(fits[1].stages[0].evaluations, 70u);
  o.map.threads = 1;
  const ForceFit again = fit_forces(test::nominal(), m, config(two), o);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(again.parameters[i].value, fits[2].parameters[i].value);
}

TEST(ForceFit, NeedsAsManyInputsAsParameters) {
  std::vector<sim::Input> inputs = default_inputs();
  inputs.resize(11);
  MeasuredMap m = simulate_forces(test::nominal(), inputs, {}, 1);
  m.name = "m.csv";
  EXPECT_EQ(test::refusal([&] { fit_forces(test::nominal(), m, config()); }),
            "m.csv: has 11 inputs for 12 parameters; accepted: at least as many inputs as parameters");
}

}  // namespace
}  // namespace flappy::identify
