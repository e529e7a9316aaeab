#include "gap/fit/robot_fit.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::robot_fit_test {
namespace {

class RobotFits : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    priors_ = new auto(synthetic_priors());
    made_ = new auto(synthetic_flights(2, synthetic_law));
    const Hypothesis wind(*priors_, {"wind"});
    Eigen::VectorXd at = wind.start();
    at[0] = -1.2;
    at[2] = 0.1;
    VehicleHypothesis truth = wind.vehicle(at);
    truth.vehicle.torso.com_m.x += 0.0015;
    for (const auto& f : *made_) f->fly(truth);
    flights_ = new Flights(as_flights(*made_));
    ModelDiscrepancy discrepancy = read_model_discrepancy();
    discrepancy.background["wind"] = 0.02;  // whatever was learnt, the wind's scale stays within its limits
    robot_ = new RobotFit(question_of(*flights_), *flights_, *priors_, discrepancy, {"tether"}, 2);
  }
  static void TearDownTestSuite() {
    delete robot_;
    delete flights_;
    delete made_;
    delete priors_;
  }
  static inline const sim::Randomisation* priors_ = nullptr;
  static inline std::vector<std::shared_ptr<SyntheticFlight>>* made_ = nullptr;
  static inline Flights* flights_ = nullptr;
  static inline RobotFit* robot_ = nullptr;
};

TEST_F(RobotFits, FitsParametersAndMinorDraws) {
  const Fit& fit = robot_->parameters();
  EXPECT_NEAR(fit.mean()[0], -1.2, 4 * std::sqrt(fit.covariance()(0, 0)));
  // 1.5 mm, of a prior of 1 mm
  EXPECT_NEAR(robot_->uncertain().minors().at(0), 1.5, 0.5);
  EXPECT_FALSE(robot_->nominal().residual.empty());
  double nominal = 0, refit = 0;
  for (std::size_t f = 0; f < 2; ++f)
    for (std::size_t i = 0; i < fit.residual[f].size(); ++i)
      nominal += std::pow(robot_->nominal().residual[f][i], 2), refit += std::pow(fit.residual[f][i], 2);
  EXPECT_LT(refit, nominal);
}

// A joint fit also moves the minor draws, so a corrected vehicle needs both.
TEST_F(RobotFits, GivesMinorDrawsOfAJointFit) {
  const RobotFit robot = RobotFit::planned(question_of(*flights_), *flights_, *priors_, read_model_discrepancy(), 2);
  const Hypothesis& h = robot.no_effects();
  const Fitter without = robot.fitter().without_background();
  const Fitter::JointFit joint =
      without.joint_fit(h, without.linearise(h, h.start(), Fitter::axes(h)), without.all_flights());
  EXPECT_EQ(robot.uncertain().minors().at(0), 0);
  EXPECT_NEAR(robot.minors_given(joint).at(0), 1.5, 0.5);
}

TEST_F(RobotFits, LeavesOutTheSurroundingsOfARig) {
  const auto knows = [](const RobotFit& robot, const char* effect) {
    return std::ranges::count(robot.magnitudes(), effect, &MagnitudeColumn::effect) > 0;
  };
  const auto planned = [&](const Flights& flights) {
    return RobotFit::planned(question_of(flights), flights, *priors_, read_model_discrepancy(), 2);
  };
  const auto made = synthetic_flights(2, synthetic_law);
  const Flights flights = as_flights(made);
  made[0]->on_bench = true;
  EXPECT_TRUE(knows(planned(flights), "wind")) << "with a flight";
  made[1]->on_bench = true;
  EXPECT_FALSE(knows(planned(flights), "wind"));
}

TEST_F(RobotFits, KnowsWhatMagnitudesChange) {
  const std::vector<MagnitudeColumn>& all = robot_->magnitudes();
  const auto wind = std::ranges::find(all, "wind", &MagnitudeColumn::effect);
  ASSERT_NE(wind, all.end());
  // 5 per m/s, and the coordinate's unit
  const double expected = 5 * unknowns_of("wind")[0].scale;
  const RegimeBasis& basis = robot_->evidence().basis();
  const double sd = std::sqrt(((*made_)[0]->velocity.squaredNorm() + (*made_)[1]->velocity.squaredNorm()) / 240 -
                              std::pow(((*made_)[0]->velocity.sum() + (*made_)[1]->velocity.sum()) / 240, 2));
  ASSERT_EQ(basis.name(2), "velocity_x");
  EXPECT_NEAR(wind->change(group_index(kSpecificForceX, 0), 2), expected * sd, 1e-3);
  EXPECT_EQ(wind->near.size(), 2u);
  EXPECT_EQ(std::ranges::find(all, "tether", &MagnitudeColumn::effect), all.end()) << "withheld";
  const auto ground = std::ranges::find(all, "ground_effect", &MagnitudeColumn::effect);
  EXPECT_EQ(ground->near.size(), 1u);
  EXPECT_FALSE(ground->large.empty());
}

// A vehicle takes background magnitudes by their moves, so each column is what its moves change.
TEST_F(RobotFits, SaysHowBackgroundsMoveUnknowns) {
  int apart = 0;
  for (const Background& b : robot_->background(read_model_discrepancy(), false)) {
    ASSERT_FALSE(b.moves.empty()) << b.effect;
    BasisCoefficients sum = BasisCoefficients::Zero(b.column.rows(), b.column.cols()), other = sum;
    for (const Background::Move& m : b.moves)
      for (const MagnitudeColumn& c : robot_->magnitudes())
        if (c.effect == m.effect && c.unknown == m.unknown) sum += m.by * c.near.front(), other += m.by * c.near.back();
    EXPECT_LT(std::min((b.column - sum).norm(), (b.column - other).norm()), 1e-12 * (1 + b.column.norm())) << b.effect;
    apart += b.moves.size() == 2 && b.moves[0].by == -b.moves[1].by ? 1 : 0;
  }
  EXPECT_GT(apart, 0) << "the wings of one effect";
  for (const Background& b : robot_->background(read_model_discrepancy(), true))
    if (b.moves.empty()) return;
  FAIL() << "a shape is no coordinate by itself";
}

TEST_F(RobotFits, WeighsHypothesesWithScalesOfTheirOwn) {
  const Hypothesis wind(robot_->uncertain(), {"wind"});
  const Fit fit = robot_->fitter().fit_effects(wind, wind.start(), robot_->parameters());
  const Scales& scales = robot_->fitter().scales();
  const double with = robot_->weigh(wind, fit, scales).posterior.log_evidence,
               without = robot_->weigh(robot_->no_effects(), robot_->parameters(), scales).posterior.log_evidence;
  EXPECT_GT(with, without);
  // with the wind in force the robot has less of its background
  const auto place = static_cast<std::size_t>(robot_->fitter().place_of("wind"));
  const Scales given = robot_->find_scales(wind, fit, scales);
  ASSERT_LT(place, given.effects.size());
  EXPECT_LT(given.effects[place], scales.effects[place]);
  // an unknown cause pays its penalty
  const ScaledEvidence unknown = robot_->weigh(robot_->no_effects(), robot_->parameters(), scales, 10);
  EXPECT_GE(unknown.posterior.log_evidence, without - 1e-6);
}

// Expectation-maximisation leads from far scales to another maximum, or stops on the way.
TEST_F(RobotFits, WeighsAContrastAlsoFromThePriorsOfItsScales) {
  const auto made = synthetic_flights(4, synthetic_law);
  const Hypothesis none(*priors_, {});
  for (const auto& f : made) f->fly(none.vehicle(none.start()));
  const Flights flights = as_flights(made, 2);
  const Flights references{flights.references, {}};
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.session = read_session_variation();
  const RobotFit contrast(question_of(flights),
                          RobotFit::of_references(question_of(references), references, *priors_, discrepancy, {}, 2),
                          flights);
  const Scales near = contrast.fitter().scales();
  Scales far = near;
  far.session *= 1e4;
  for (std::size_t b = 0; b < kBlocks; ++b)
    if (block_of_tests(b)) far.blocks[b] *= 1e4;
  const auto log_evidence = [&](const Scales& start) {
    return contrast.weigh(contrast.no_effects(), contrast.parameters(), start).posterior.log_evidence;
  };
  EXPECT_NEAR(log_evidence(far), log_evidence(near), 0.5);
}

// In flight and on a bench backgrounds are apart: each has the rows of one of them, and what it weighs there.
TEST_F(RobotFits, HasBackgroundsOfItsOwnOnABench) {
  const auto made = synthetic_flights(4, synthetic_law);
  const Hypothesis none(*priors_, {});
  made[2]->on_bench = made[3]->on_bench = true;
  for (const auto& f : made) f->fly(none.vehicle(none.start()));
  const Flights flights = as_flights(made);
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.background["wind"] = 0.1, discrepancy.background["wind_on_bench"] = 0.02;
  const RobotFit robot = RobotFit::planned(question_of(flights), flights, *priors_, discrepancy, 2);
  const auto flown = static_cast<Eigen::Index>(kRowsPerBeat);
  const auto rms = [&](const std::string& name, bool on_bench) {
    double sum = 0;
    for (const Background& b : robot.background(discrepancy, false))
      if (b.effect == name)
        sum += (on_bench ? b.column.bottomRows(kGroups - flown) : b.column.topRows(flown)).squaredNorm();
    return std::sqrt(sum);
  };
  const std::string name = "wind", on_bench = name + kOnBench;
  EXPECT_GT(rms(name, false), 0);
  EXPECT_EQ(rms(name, true), 0);
  EXPECT_EQ(rms(on_bench, false), 0);
  const double weight = rms(on_bench, true);
  discrepancy.background["wind_on_bench"] = 0.04;
  EXPECT_NEAR(rms(on_bench, true), 2 * weight, 1e-12 * weight);
  EXPECT_GT(weight, 0);
  for (const Background& b : robot.background(discrepancy, false))
    EXPECT_EQ(b.moves.empty(), b.effect.ends_with(kOnBench)) << b.effect << ": a corrected vehicle flies";
}

// The same by a search for the scale t that makes magnitudes most probable as background: -log N(0, (t sd)^2), and the cost of t.
TEST_F(RobotFits, SaysHowMuchMoreProbableMagnitudesAreAsAnEffect) {
  const ModelDiscrepancy discrepancy = read_model_discrepancy();
  const auto background = [&](const std::string& effect, const Eigen::VectorXd& magnitudes) {
    double least = 1e300;
    for (double log_t = -3; log_t < 6; log_t += 1e-3) {
      const double sd = std::exp(log_t) * discrepancy.background_sd(effect);
      least = std::min(least, 0.5 * magnitudes.squaredNorm() / (sd * sd) +
                                  static_cast<double>(magnitudes.size()) * std::log(sd) +
                                  Evidence::scale_cost_nats(std::exp(log_t), discrepancy.scale_prior(effect), {}));
    }
    return least;
  };
  const Eigen::Vector3d offset(0.4, -0.1, 1.2);
  EXPECT_NEAR(robot_->beyond_background("com_offset", offset, {}),
              background("com_offset", offset) - 0.5 * offset.squaredNorm(), 1e-5);
  const Eigen::Vector2d one(0.5, 0), both(0.5, 0.5);
  const auto sides = [&](double apart, double alike) {
    return background("wing_damage", Eigen::VectorXd::Constant(1, apart)) +
           background("wing_damage_of_both", Eigen::VectorXd::Constant(1, alike));
  };
  EXPECT_NEAR(robot_->beyond_background("wing_damage", one, {}), sides(0.5 / std::sqrt(2), 0.5 / std::sqrt(2)) - 0.125,
              1e-5);
  EXPECT_NEAR(robot_->beyond_background("wing_damage", both, {}), sides(0, std::sqrt(0.5)) - 0.25, 1e-5);
}

TEST_F(RobotFits, ReportsTheLagAndErrorsOfSensors) {
  const std::vector<SensorFinding> found =
      robot_->sensors(robot_->fitter(), robot_->no_effects(), robot_->parameters());
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().name, "imu.latency_s");
  EXPECT_NEAR(found.front().sd, found.front().prior_sd, 1e-9) << "these flights say nothing of it";
}

TEST(Residuals, OfReferencesAreWithoutEffects) {
  const sim::Randomisation priors = synthetic_priors();
  const auto made = synthetic_flights(3, synthetic_law);
  const Flights flights = as_flights(made, 2);
  const Hypothesis wind(priors, {"wind"});
  Eigen::VectorXd at = wind.start(), windy = at;
  windy[2] = 1;
  const std::vector<Residuals> r = residuals(flights, {wind.vehicle(at), wind.vehicle(windy)}, 1);
  EXPECT_EQ(r[0][0], r[1][0]);
  EXPECT_EQ(r[0][1], r[1][1]);
  EXPECT_NE(r[0][2], r[1][2]);
  EXPECT_EQ(made[0]->predicted, 1u) << "both vehicles share one prediction";
  EXPECT_EQ(residuals(flights, {wind.vehicle(windy)}, 1)[0], r[1]);
  EXPECT_EQ(made[0]->predicted, 1u) << "which is kept";
  EXPECT_EQ(made[2]->predicted, 3u);
}

// The model is off by something that follows the velocity as wind does, in all flights. Wind appears in the tests alone.
TEST(Contrast, TellsWhatAppearedFromWhatWasAlwaysOff) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis none(priors, {}), wind(priors, {"wind"});
  const auto flown = [&](double appears) {
    auto made = synthetic_flights(4, synthetic_law);
    for (std::size_t f = 0; f < 4; ++f) {
      Eigen::VectorXd at = wind.start();
      at[0] = 0.7;
      at[2] = f < 2 ? 0 : appears;
      made[f]->fly(wind.vehicle(at));
      made[f]->add_measured(kSpecificForceX, 0, 0.3 * made[f]->velocity);
    }
    return made;
  };
  const auto gain = [&](double appears) {
    const auto made = flown(appears);
    const Flights flights = as_flights(made, 2), references{flights.references, {}};
    ModelDiscrepancy discrepancy = read_model_discrepancy();
    discrepancy.session = fixed_session_variation();
    const RobotFit robot(question_of(flights),
                         RobotFit::of_references(question_of(references), references, priors, discrepancy, {}, 2),
                         flights);
    const Hypothesis h(robot.uncertain(), {"wind"});
    const Fit fit = robot.fitter().fit_effects(h, h.start(), robot.parameters());
    if (appears != 0) EXPECT_NEAR(fit.mean()[2], appears, 4 * std::sqrt(fit.covariance()(2, 2)));
    const Scales& scales = robot.fitter().scales();
    return robot.weigh(h, fit, scales).posterior.log_evidence -
           robot.weigh(robot.no_effects(), robot.parameters(), scales).posterior.log_evidence;
  };
  EXPECT_GT(gain(0.3), 2) << "little, as another law may change one coefficient as it likes";
  EXPECT_LT(gain(0), -4);
}

// Something follows the velocity in the tests, but in other harmonics and axes than a wind. Deviations of the wind's law
// explain it; the wind does not.
TEST(Contrast, NamesNoEffectForWhatOnlyItsLawExplains) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis wind(priors, {"wind"});
  auto made = synthetic_flights(4, synthetic_law);
  for (std::size_t f = 0; f < 4; ++f) {
    Eigen::VectorXd at = wind.start();
    at[2] = f < 2 ? 0 : 0.05;
    made[f]->fly(wind.vehicle(at));
    if (f >= 2) made[f]->add_measured(kSpecificForceZ, 1, 0.5 * made[f]->velocity);
  }
  const Flights flights = as_flights(made, 2), references{flights.references, {}};
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.session = fixed_session_variation();
  discrepancy.session.scale_sd = discrepancy.session.own_scale_sd = 0.1;  // else sessions may differ by as much
  discrepancy.session.law_error.fill(1);  // and laws by as much as the change here is off
  const RobotFit robot(question_of(flights),
                       RobotFit::of_references(question_of(references), references, priors, discrepancy, {}, 2),
                       flights);
  const Fit fit = robot.fitter().fit_effects(wind, wind.start(), robot.parameters());
  const Scales& scales = robot.fitter().scales();
  const double parameters = robot.weigh(robot.no_effects(), robot.parameters(), scales).posterior.log_evidence,
               all = robot.weigh(wind, fit, scales).posterior.log_evidence - parameters,
               laws = question_of(flights).other_laws(robot, wind, fit).log_evidence - parameters;
  EXPECT_GT(all, 5);
  EXPECT_GT(laws, 0.5 * all);
}

// Everything changes a little from session to session: of one robot by 0.2 % of the signal, of another by ten times as
// much. In the tests the vertical force changes with the velocity by 3 %: much for the one, and little for the other.
TEST(Contrast, MeasuresAChangeByTheRobotsOwnSessions) {
  const sim::Randomisation priors = synthetic_priors();
  const auto look = [&](double scatter) {
    auto made = synthetic_flights(5, synthetic_law);
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal(0, scatter * SyntheticFlight::kSignal);
    for (std::size_t f = 0; f < 5; ++f) {
      made[f]->fly(Hypothesis(priors, {}).vehicle(Hypothesis(priors, {}).start()));
      if (f == 4) break;  // of the session of flight 3
      for (const int channel : {kSpecificForceX, kSpecificForceZ, kAngularAccelerationY})
        for (const int coefficient : {0, 1})
          for (const Eigen::VectorXd& v : {made[f]->velocity, made[f]->amplitude})
            made[f]->add_measured(channel, coefficient, normal(random) * v);
    }
    for (std::size_t f = 3; f < 5; ++f)
      made[f]->add_measured(kSpecificForceZ, 0, 0.03 * SyntheticFlight::kSignal * made[f]->velocity);
    const Flights flights = as_flights(made, 3), references{flights.references, {}};
    ModelDiscrepancy discrepancy = read_model_discrepancy();
    discrepancy.session = fixed_session_variation();
    const RobotFit robot(question_of(flights),
                         RobotFit::of_references(question_of(references), references, priors, discrepancy, {}, 2),
                         flights);
    const SessionVariation& session = robot.evidence().discrepancy().session;
    EXPECT_EQ(session.own.value().count, 3);
    const ScaledEvidence held = robot.weigh(robot.no_effects(), robot.parameters(), robot.fitter().scales()),
                         free = robot.weigh(robot.no_effects(), robot.parameters(), robot.fitter().scales(), 0);
    return std::pair(session.log_scale(), free.posterior.log_evidence - held.posterior.log_evidence);
  };
  const auto calm = look(0.002), restless = look(0.02);
  EXPECT_GT(restless.first, calm.first + 1.5) << "ten times, less what the prior of all robots holds back";
  EXPECT_GT(calm.second, 10);
  EXPECT_LT(restless.second, 0.5 * calm.second);
}

// The wind differs from session to session, of one robot by nothing, of another by as much as in the tests.
TEST(Contrast, LearnsFromItsSessionsWhatChangesHarmlessly) {
  const sim::Randomisation priors = synthetic_priors();
  const Hypothesis wind(priors, {"wind"});
  const auto gain = [&](const std::vector<double>& winds) {
    auto made = synthetic_flights(winds.size(), synthetic_law);
    for (std::size_t f = 0; f < winds.size(); ++f) {
      Eigen::VectorXd at = wind.start();
      at[2] = winds[f];
      made[f]->fly(wind.vehicle(at));
    }
    const Flights flights = as_flights(made, winds.size() - 1), references{flights.references, {}};
    ModelDiscrepancy discrepancy = read_model_discrepancy();
    discrepancy.session = fixed_session_variation();
    const RobotFit robot(question_of(flights),
                         RobotFit::of_references(question_of(references), references, priors, discrepancy, {}, 2),
                         flights);
    const Fit fit = robot.fitter().fit_effects(wind, wind.start(), robot.parameters());
    const Scales& scales = robot.fitter().scales();
    return robot.weigh(wind, fit, scales).posterior.log_evidence -
           robot.weigh(robot.no_effects(), robot.parameters(), scales).posterior.log_evidence;
  };
  const double still = gain({0, 0, 0, 0, 0, 0.1}), gusty = gain({0.1, -0.1, 0, 0.08, -0.1, 0.1});
  EXPECT_GT(still, 2);
  EXPECT_LT(gusty, still - 1);
}

// Something acts along the velocity in the tests alone. Where references never moved, it may have acted before.
TEST(Contrast, CallsUnknownOnlyWhatReferencesWouldHaveShown) {
  const sim::Randomisation priors = synthetic_priors();
  const auto freed = [&](double calm) {
    auto made = synthetic_flights(4, synthetic_law);
    for (std::size_t f = 0; f < 4; ++f) {
      if (f < 2) made[f]->velocity *= calm;
      made[f]->fly(Hypothesis(priors, {}).vehicle(Hypothesis(priors, {}).start()));
      if (f >= 2) made[f]->add_measured(kAngularAccelerationY, 1, made[f]->velocity);
    }
    const Flights flights = as_flights(made, 2), references{flights.references, {}};
    ModelDiscrepancy discrepancy = read_model_discrepancy();
    discrepancy.session = fixed_session_variation();
    const RobotFit robot(question_of(flights),
                         RobotFit::of_references(question_of(references), references, priors, discrepancy, {}, 2),
                         flights);
    EXPECT_EQ(robot.fitter().place_of(std::string(kModelOf) + "body_drag") >= 0, calm < 1)
        << "errors of the model do not cancel";
    const ScaledEvidence w = robot.weigh(robot.no_effects(), robot.parameters(), robot.fitter().scales(), 10);
    return std::ranges::count(w.scales.free, 1);
  };
  EXPECT_GE(freed(1), 1);
  EXPECT_EQ(freed(0.05), 0);
}

}  // namespace
}  // namespace flappy::gap::robot_fit_test
