// The parts of a diagnosis on simulated flights, where the truth is known.
#include "gap/answer/inference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>

#include "full.hpp"
#include "gap/flown_flights.hpp"
#include "gap/replay/sensor_correction.hpp"
#include "io/files.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap::inference_test {
namespace {

using Eigen::Index;

TEST(Fit, FindsTheIdentifiedVehicleFromTheNominalOne) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Flights flights = flown("hummingbird_identified");
  const sim::Randomisation prior = shipped_priors();
  const Hypothesis none(prior, {});
  Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 2);
  Fitter fitter(question_of(flights), flights, std::make_shared<const Evidence>(evidence), 2);
  const auto take = [&](Evidence learnt) {
    evidence = std::move(learnt);
    fitter = fitter.with_evidence(std::make_shared<const Evidence>(evidence));
  };
  const Fit start = fitter.linearise(none, none.start(), {Eigen::MatrixXd(none.size(), 0), Eigen::VectorXd(0)});
  take(evidence.with_weights(start.residual));
  Fit fit = fitter.fit(none, none.start(), 4);
  take(evidence.with_weights(fit.residual));
  fit = fitter.refit(none, fit, 3);
  const int groups[] = {kAngularAccelerationX * kCoefficients, kAngularAccelerationZ * kCoefficients + 1,
                        kSpecificForceY * kCoefficients, kStrokeLeft * kCoefficients};
  std::vector<double> declared;
  const Rows noise = flights[0]->declared_noise(1);
  for (const int g : groups) {
    declared.push_back(evidence.noise_sd(g));
    // of one course of the noise, whose innovations are found with its memory
    EXPECT_LT(declared.back(), 1.2 * rms(*flights[0], noise, g)) << g;
    EXPECT_GT(declared.back(), 0.4 * rms(*flights[0], noise, g)) << g;
  }
  take(evidence.with_noise(fit.residual));
  // what a right model leaves is noise as declared, to the 8 % of a median of 200, and no less by definition; of the mean force also
  // that of the motion to which the torso is reset
  for (std::size_t i = 0; i < declared.size(); ++i)
    EXPECT_LT(evidence.noise_sd(groups[i]), (groups[i] == kSpecificForceY * kCoefficients ? 1.7 : 1.35) * declared[i])
        << groups[i];
  fit = fitter.refit(none, fit, 3);
  const model::Vehicle truth = model::read_vehicle(kTestConfigs + "vehicles/hummingbird_identified.toml");
  const Eigen::VectorXd mean = fit.mean();
  const Eigen::MatrixXd covariance = fit.covariance();
  const auto off = [&](const std::string& path, double coordinate) {
    for (Index i = 0; i < none.shared(); ++i)
      if (none.unknowns()[static_cast<std::size_t>(i)].name == path)
        return (mean[i] - coordinate) / std::sqrt(covariance(i, i));
    ADD_FAILURE() << path;
    return 0.0;
  };
  // of its own prior, in standard deviations of what the flight tells; 4 of them hold for all of eight
  EXPECT_LT(std::abs(off("left.motor.resistance_ohm", (truth.left.motor.resistance_ohm / 12.4 - 1) / 0.1)), 4);
  EXPECT_LT(std::abs(off("right.motor.resistance_ohm", (truth.right.motor.resistance_ohm / 12.4 - 1) / 0.1)), 4);
  EXPECT_LT(std::abs(off("left.spring.rest_angle_rad", truth.left.spring.rest_angle_rad / 0.05)), 4);
  EXPECT_LT(std::abs(off("right.spring.rest_angle_rad", truth.right.spring.rest_angle_rad / 0.05)), 4);
  EXPECT_LT(std::abs(off("left.rotation.lower_rad", (truth.left.rotation.lower_rad / -0.7854 - 1) / 0.07)), 4);
  EXPECT_LT(std::abs(off("right.rotation.upper_rad", (truth.right.rotation.upper_rad / 0.7854 - 1) / 0.07)), 4);
  EXPECT_LT(std::abs(off("air.density_kg_m3", 0)), 4);
  EXPECT_LT(std::abs(off("torso.mass_kg", 0)), 4);
  // and it does tell: rest angles and stops to a tenth of their prior
  for (Index i = 0; i < none.shared(); ++i)
    if (none.unknowns()[static_cast<std::size_t>(i)].name.find("rest_angle") != std::string::npos)
      EXPECT_LT(std::sqrt(covariance(i, i)), 0.1);
  // an effect that changes nothing, here a wall where there is none, explains just as much given the same parameters
  const Hypothesis wall(prior, {"wall_effect"});
  Eigen::VectorXd at = wall.start();
  at[wall.shared()] = 1;
  const Fit given = fitter.fit_effects(wall, at, fit);
  EXPECT_EQ(given.at.head(none.size()), fit.at);
  EXPECT_NEAR(given.posterior.log_evidence, fit.posterior.log_evidence, 1);
}

TEST(Diagnose, StopsWithWhatItHas) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Flights flights = flown("hummingbird_nominal");
  InferenceOptions options = shipped_options();
  options.threads = 2;
  options.progress = [](double, const std::string&) { return false; };
  const Inference d = infer(flights, shipped_priors(), options);
  EXPECT_FALSE(d.complete);
  ASSERT_EQ(d.hypotheses.size(), 3 + model::effects().size());
  double sum = 0;
  for (const ScoredHypothesis& a : d.hypotheses) {
    EXPECT_TRUE(a.held_out.empty());
    sum += a.probability;
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_EQ(d.hypotheses[0].kind, HypothesisKind::none);
}

// Minor draws: a wing's centre of mass, a spring that is stiffer one way, an inertia about one axis.
TEST(RobotFit, FliesMinorDraws) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Flights flights =
      flown("hummingbird_nominal",
            {"vehicle.left.wing.com_m.x=0.0006", "vehicle.right.spring.stiffness_positive_Nm_rad=0.0147",
             "vehicle.right.leading_edge.inertia_kg_m2.zz=1.0e-7",
             "vehicle.right.leading_edge.inertia_kg_m2.xx=1.422e-7", "flight.duration_s=5"});
  const std::string text = io::read_text(kTestConfigs + "gap/priors.toml");
  const auto fitted = [&](const std::string& priors) {
    const sim::Randomisation prior =
        sim::read_randomisation(nominal_vehicle(), io::Config::parse(priors, "priors.toml").root());
    auto robot = std::make_unique<RobotFit>(question_of(flights), flights, prior, read_model_discrepancy(),
                                            std::vector<std::string>{}, 2);
    return robot;
  };
  const std::size_t minor = text.find("# Minor parameters");
  ASSERT_NE(minor, std::string::npos);
  const auto robot = fitted(text), without = fitted(text.substr(0, minor));
  EXPECT_GT(without->fitter().scales().robot, 1.5 * robot->fitter().scales().robot) << "errors of the model else";
  const sim::Randomisation& found = robot->uncertain();
  std::map<std::string, double> minors;
  for (std::size_t d = found.majors(); d < found.draws(); ++d)
    minors.try_emplace(found.name(d), found.minors()[d - found.majors()]);
  EXPECT_NEAR(minors.at("left.wing.com_m.x"), 0.0006 / 0.0003, 1) << "in units of what is believed";
}

// How a wing lands on its stop turns with its spring: the change by a large magnitude is not that by a background magnitude.
// So is a clock that runs 60 ppm fast: over 5 s it turns the fourth harmonic by 0.13 rad at either end.
TEST(Diagnose, NamesNoEffectForWhatAnyRobotMayHave) {
  Flights flights =
      flown("hummingbird_nominal", {"vehicle.effects.spring_hardening.per_rad2=-0.015", "flight.duration_s=5"});
  flights.tests[0] = flights[0]->with_log(without({{"imu_clock", {{"rate", -6e-5}}}}, flights[0]->recording()->log));
  InferenceOptions options = shipped_options();
  options.threads = 2;
  options.discrepancy.background["spring_hardening"] = 0.08;
  const Inference d = infer(flights, shipped_priors(), options);
  EXPECT_TRUE(d.verdict.effects.empty()) << d.verdict.effects[0];
  const auto clock = std::ranges::find(d.sensors, "imu_clock.rate", &SensorFinding::name);
  ASSERT_NE(clock, d.sensors.end());
  EXPECT_NEAR(clock->value, 6e-5, 4 * clock->sd);
  EXPECT_LT(clock->sd, 1e-5);
  // the prediction of the parameters includes nuisances, and is better than the file's, to 1.5 sd of noise
  const auto left = [&](const Residuals& residual) {
    double sum = 0, n = 0;
    for (std::size_t j = 0; j < flights[0]->beats(); ++j)
      for (int g = kAngularAccelerationX * kCoefficients; g < (kSpecificForceZ + 1) * kCoefficients; ++g)
        if (flights[0]->covers(j, g / kCoefficients)) {
          const auto row = static_cast<std::size_t>(g);
          sum += std::pow(residual[0][j * kRowsPerBeat + row] / d.noise_sd[row], 2);
          n += 1;
        }
    return sum / n;
  };
  EXPECT_LT(left(d.refit), left(d.nominal));
  EXPECT_LT(left(d.refit), 1.5 * 1.5);
}

// A third of a beat and more: near 0 its derivative shows nothing of it.
TEST(Screening, FindsALongDelay) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Flights flights =
      flown("hummingbird_nominal", {"vehicle.effects.command_delay.delay_s=0.013", "flight.duration_s=5"});
  const sim::Randomisation prior = shipped_priors();
  const RobotFit robot(question_of(flights), flights, prior, read_model_discrepancy(), {}, 2);
  const ScreenedEffect first = screen(robot.fitter(), robot.parameters(), robot.magnitudes()).front();
  EXPECT_EQ(first.effect, "command_delay");
  EXPECT_GT(first.gain, 50);
  const Unknown delay = unknowns_of("command_delay").front();
  EXPECT_NEAR(delay.value(first.coordinates[0]), 0.013, 0.002) << "steps are 0.0036 s";
}

}  // namespace
}  // namespace flappy::gap::inference_test
