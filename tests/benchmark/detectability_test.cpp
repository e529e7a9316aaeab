// The formula of detectability against draws, its search on hand-made information, and the robot's reset predictions against its own
// flights.
#include "benchmark/detectability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "benchmark/family_detectability.hpp"
#include "full.hpp"
#include "gap/evidence/hypothesis.hpp"
#include "model/effects/registry.hpp"
#include "vehicles.hpp"

namespace flappy::benchmark {
using namespace blind;
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double log_normal(const VectorXd& r, const MatrixXd& covariance) {
  const Eigen::LLT<MatrixXd> llt(covariance);
  return -0.5 * r.dot(llt.solve(r)) - llt.matrixLLT().diagonal().array().log().sum();
}

// Twelve rows, two parameters; the truth is beside both columns of the hypothesis. Of 20,000 draws the mean of the differences,
// each worked out from whole covariances, within four of its standard errors.
TEST(DetectabilityAnalysis, ExpectsWhatDrawsGive) {
  constexpr Index kRows = 12;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto draw = [&](Index rows, Index columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }));
  };
  // little is known of the second coefficient, so that what learning it costs shows
  const MatrixXd parameters = 2 * draw(kRows, 2), both = 0.4 * draw(kRows, 2);
  const MatrixXd covariance = MatrixXd::Identity(kRows, kRows) + parameters * parameters.transpose();
  const VectorXd precision = Eigen::Vector2d(0.2, 1), weights = Eigen::Vector2d(4, 1);
  MatrixXd columns(kRows, 3);
  columns << both, both * weights + 0.3 * draw(kRows, 1);
  const VectorXd truth = Eigen::Vector3d::UnitZ();
  const MatrixXd hypothesis = MatrixXd::Identity(3, 2);
  const MatrixXd wide = covariance + both * precision.cwiseInverse().asDiagonal() * both.transpose();

  const MatrixXd information = columns.transpose() * covariance.llt().solve(columns);

  const Eigen::LLT<MatrixXd> llt(covariance);
  double sum = 0, squares = 0;
  constexpr int kDraws = 20000;
  for (int n = 0; n < kDraws; ++n) {
    const VectorXd r = columns.col(2) + llt.matrixL() * draw(kRows, 1);
    const double gain = log_normal(r, wide) - log_normal(r, covariance);
    sum += gain, squares += gain * gain;
  }
  const double mean = sum / kDraws, error = std::sqrt((squares / kDraws - mean * mean) / kDraws);
  EXPECT_NEAR(expected_gain(information, truth, hypothesis, precision), mean, 4 * error);
  EXPECT_GT(mean, 20 * error) << "nothing was tested";
}

TEST(DetectabilityAnalysis, FindsTheSizeAndTheRivals) {
  std::array<DetectabilityAnalysis::Columns, kBlindEffects> effects;
  const auto give = [&](Effect e) -> DetectabilityAnalysis::Columns& { return effects[static_cast<std::size_t>(e)]; };
  give(Effect::added_mass) = {{1, 2}, {0, 1}, {}};
  give(Effect::body_drag) = {{1}, {2}, {3}};
  give(Effect::tether) = {{1}, {4}, {}};
  give(Effect::wall_effect) = {{1, 2}, {5, 6}, {}};
  // rows: added_mass goes along x, at size 2 three times as far; body_drag along x + y, further along x - y; tether along z,
  // and wall_effect, which is smaller at size 2
  MatrixXd rows(3, 7);
  rows << 1, 3, 1, 1, 0, 0, 0,  //
      0, 0, 1, -1, 0, 0, 0,     //
      0, 0, 0, 0, 1, 1, 0.9;
  const DetectabilityAnalysis analysis(effects, 300 * rows.transpose() * rows);
  // the truth is straight of the next larger size tried, 1 or 3 along x; the hypothesis, of the other one, m, with prior
  // precision of its coefficient size^2/4
  const auto expected = [](double size) {
    const double d = size <= 1 ? size : 1.5 * size;
    const double m = size <= 1 ? 3 : 1, tried = size <= 1 ? 2 : 1;
    const double prior = tried * tried / 4, a = 300 * m * m, f = 300 * m * d;
    return 0.5 * (f * f / (a + prior) + a / (a + prior) - std::log1p(a / prior)) / 3;
  };
  for (const double size : {0.2, 1.0, 1.5, 2.0})
    EXPECT_NEAR(analysis.gain(Effect::added_mass, size), expected(size), 1e-9 * expected(size)) << size;
  EXPECT_EQ(analysis.gain(Effect::added_mass, 2.1), 0) << "not tried";
  EXPECT_EQ(analysis.gain(Effect::wind, 1), 0) << "not tried";
  const double found = analysis.detectable(Effect::added_mass, 10);
  EXPECT_NEAR(expected(found), 10, 1e-3);
  EXPECT_TRUE(std::isinf(analysis.detectable(Effect::added_mass, 1e6)));
  const double lasting = analysis.detectable(Effect::wall_effect, 20);
  EXPECT_GT(analysis.gain(Effect::wall_effect, lasting), 22);
  EXPECT_NEAR(analysis.gain(Effect::wall_effect, 2 * lasting), 20, 1e-3);
  // body_drag and its direction together are as good, but for what one more coefficient costs; tether says nothing of it
  // a third of 1/2 log(1 + 600 / 0.25)
  for (const double size : {1.0, 1.5})
    EXPECT_LT(std::abs(analysis.gain_over(Effect::added_mass, size, Effect::body_drag)), 1.3) << size;
  EXPECT_NEAR(analysis.gain_over(Effect::added_mass, 1, Effect::tether), analysis.gain(Effect::added_mass, 1), 0.5);
}

Case flown(const std::vector<BlindEffect>& effects) {
  Case c{.vehicle = test::identified(), .sizes = Sizes(effects), .seed = 11};
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  return c;
}

gap::PredictedFlight predicted(const Case& c, std::size_t flight) {
  RobotFlight f = fly(c, flight);
  EXPECT_FALSE(f.crashed) << f.how;
  return gap::PredictedFlight(gap::Recording("flight", std::move(f.log), c.vehicle));
}

/// Rms over beats of the steady turn and force, [channel].
std::array<double, 6> mean_rms(const gap::PredictedFlight& flight, const gap::Rows& rows) {
  std::array<double, 6> rms{};
  for (std::size_t s = 0; s < 6; ++s) {
    double n = 0;
    for (std::size_t j = 0; j < flight.beats(); ++j) {
      if (!flight.covers(j, static_cast<int>(s))) continue;
      n += 1;
      rms[s] += std::pow(rows[j * gap::kRowsPerBeat + s * gap::kCoefficients], 2);
    }
    rms[s] = std::sqrt(rms[s] / n);
  }
  return rms;
}

/// What a perturbed robot leaves of them.
std::array<double, 6> left(const gap::PredictedFlight& flight, const Perturbation& perturbation) {
  gap::Rows rows = predict_perturbed(flight, perturbation, 0);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = flight.measured()[i] - rows[i];
  return mean_rms(flight, rows);
}

// A robot that predicts its own flight leaves the noise of the sensors, and half as much for what the record gets wrong of the torso's motion.
// How it lived before the record is known nearly: a battery is as empty as the first beats of it, repeated, leave it, to some percent.
// Without the effect that it flew with, what is left is several times as much.
TEST(ResetPrediction, KnowsItsOwnFlight) {
  if (!test::full()) GTEST_SKIP() << "takes ten seconds: with --full";
  for (const std::vector<BlindEffect>& effects : {std::vector<BlindEffect>{{"coulomb_friction", 1}, {"body_drag", 1}},
                                                  {{"wind", 2}},            // its gusts come as they came
                                                  {{"battery_sag", 4}}}) {  // empty by as much as the trim took
    const Case c = flown(effects);
    const gap::PredictedFlight flight = predicted(c, 0);
    const auto with = left(flight, {c.vehicle, c.sizes, c.seed}), without = left(flight, {c.vehicle, {}, c.seed});
    const auto noise = mean_rms(flight, flight.declared_noise(1));
    double worst = 0;
    for (std::size_t s = 0; s < 6; ++s) {
      EXPECT_LT(with[s], 1.5 * noise[s] + 0.02 * without[s])
          << effects[0].id << ' ' << gap::channel_name(static_cast<int>(s));
      worst = std::max(worst, without[s] / with[s]);
    }
    EXPECT_GT(worst, 2) << effects[0].id;
  }
}

TEST(ResetPrediction, LagsByWholeSteps) {
  const Case c = flown({});
  const gap::PredictedFlight flight = predicted(c, 0);
  const gap::Rows expected = predict_perturbed(flight, {c.vehicle, {}, c.seed, 1}, 0);
  gap::Recording late = flight.recording();
  for (std::vector<double>* v : {&late.left_V, &late.right_V}) {
    v->insert(v->begin(), v->front());
    v->pop_back();
  }
  EXPECT_EQ(predict_perturbed(gap::PredictedFlight(std::move(late)), {c.vehicle, {}, c.seed, 0}, 0), expected);
}

TEST(Subject, SensorsDoNotChangeTheFlight) {
  const RobotFlight plain = fly(flown({}), 0);
  std::vector<BlindEffect> all;
  for (std::size_t e = 0; e < kBlindEffects; ++e)
    if (acts_on_sensors(static_cast<Effect>(e))) all.push_back({effect_names()[e], 2});
  const RobotFlight f = fly(flown(all), 0);
  EXPECT_EQ(f.log.command, plain.log.command);
  EXPECT_NE(f.log.imu, plain.log.imu);
  EXPECT_NE(f.log.mocap, plain.log.mocap);
  for (std::size_t k = 0; k < 22; ++k) EXPECT_EQ(f.truth[k], plain.truth[k]) << k;
}

// With j = b' C^-1 b of a column b of the background, what is known of a coefficient of b beside one of variance 1 is
// j/(1 + j), and less beside others: less than the little that every vehicle has says nothing.
TEST(Subject, LessThanEveryVehicleHasSaysNothing) {
  if (!test::full()) GTEST_SKIP() << "all effects' sizes on all flights: with --full";
  const Case c = flown({});
  const Subject subject(c, fly_all(c, 2), 2);
  const std::vector<gap::BasisCoefficients> background = subject.background();
  std::size_t sizes = 0;
  for (const model::EffectEntry& e : model::effects()) sizes += static_cast<std::size_t>(e.info.sizes);
  ASSERT_EQ(background.size(), sizes);
  const std::vector<gap::BasisCoefficients> some = {background.front(), background[sizes / 2], background.back()};
  const MatrixXd alone = subject.information({}, some), beside = subject.information(background, some);
  for (Index i = 0; i < 3; ++i) {
    EXPECT_GT(alone(i, i), beside(i, i));
    const std::vector<gap::BasisCoefficients> b = {some[static_cast<std::size_t>(i)]};
    const double j = alone(i, i), known = subject.information(b, b)(0, 0);
    EXPECT_NEAR(known, j / (1 + j), 1e-9);
    EXPECT_LT(beside(i, i), known * (1 + 1e-9));
    EXPECT_GT(beside(i, i), 0);
  }
  // a column is as large as the catalogue's entry at that coordinate
  const std::string first = model::effects().front().info.id;
  const auto unknowns = static_cast<Index>(gap::unknowns_of(first).size());
  const double sd = gap::read_model_discrepancy().background_sd(first), reach = 0.4;
  const std::vector<VectorXd> at = {reach * VectorXd::Unit(unknowns, 0)};
  const gap::BasisCoefficients there = subject.catalogue(first, at)[0];
  EXPECT_LT((background.front() - sd / reach * there).norm(), 1e-12 * there.norm());
}

// Effects whose size both sides state in the same units: the entry comes out as what was put in. Poses
// are jittered by as much as a tenth of the delay.
TEST(TrueValues, FindsWhatWasPutIn) {
  const auto uncertain =
      sim::read_randomisation(test::nominal(), io::Config::load(test::source_path("configs/gap/priors.toml")).root());
  if (!test::full()) GTEST_SKIP() << "fits for 15 s: scripts/test --full";
  const std::vector<BlindEffect> put_in{{"mocap_delay", 1}, {"com_offset", 2}, {"mocap_tilt", 2}};
  const auto values = true_values(flown({}), put_in, uncertain, 2);
  const auto at = [&](const char* name) {
    const auto found = values.find(name);
    if (found == values.end() || !found->second) ADD_FAILURE() << name;
    return found == values.end() ? 0 : found->second.value_or(0);
  };
  EXPECT_NEAR(at("mocap_delay.delay_s"), 0.005, 0.0005);
  EXPECT_EQ(values.size(), 6u);
  EXPECT_NEAR(std::hypot(at("mocap_tilt.x_rad"), at("mocap_tilt.y_rad")), 0.02, 0.002);
  EXPECT_NEAR(std::hypot(at("com_offset.x_m"), at("com_offset.y_m")), 0.002, 0.0002);
}

// ---- of families

/// 1,000 beats of a robot that hovers: its weight, and a first harmonic of 10 sqrt 2 m/s^2 along x, so that the three forces have a
/// waveform of sqrt((96.04 + 100)/3) = 8.084 m/s^2.
Changed hovering() {
  Changed c;
  c.flapping_Hz = 34;
  c.change.resize(1000);
  c.signal.resize(1000);
  for (auto& s : c.signal) s[1] = 10 * std::numbers::sqrt2, s[10] = 9.8;
  return c;
}

TEST(FamilyDetectability, MeasuresByTheWeightAndTheWaveform) {
  // up and down from beat to beat, which nothing takes over
  Changed c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) c.change[b][10] = b % 2 == 0 ? 0.49 : -0.49;
  Shown s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.05, 1e-9);
  EXPECT_EQ(s.channel, 2U);
  EXPECT_EQ(s.order, 0U);
  EXPECT_NEAR(detectable_size(c, 2), kShare / 0.05, 1e-6);
  EXPECT_EQ(detectable_size(c, 0.2), std::numeric_limits<double>::infinity());
  // in y, which has no signal of its own, a harmonic is measured by the waveform: (0.4^2 + 0.3^2)/2 has the root 0.35355
  c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) {
    c.change[b][5 + 3] = b % 2 == 0 ? 0.4 : -0.4;
    c.change[b][5 + 4] = b % 2 == 0 ? 0.3 : -0.3;
  }
  s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.35355 / 8.0838, 1e-4);
  EXPECT_EQ(s.channel, 1U);
  EXPECT_EQ(s.order, 2U);
  // a tenth of the beats is enough
  for (std::size_t b = 100; b < c.change.size(); ++b) c.change[b].fill(0);
  EXPECT_NEAR(shown(c, 1).share, s.share, 1e-4);
  EXPECT_EQ(shown(hovering(), 1).share, 0);
  EXPECT_EQ(shown({}, 1).share, 0);
}

TEST(FamilyDetectability, LeavesToFiguresAndLatenessWhatTheyTakeOver) {
  // 8 % more of the wing beat, 0.4 ms late, and a push of 2 % of the weight: all is taken over, of twice as much is not
  Changed c = hovering();
  const double late = 4e-4 * 2 * std::numbers::pi * 34 * 10 * std::numbers::sqrt2;
  for (auto& d : c.change) d[1] = 0.08 * 10 * std::numbers::sqrt2, d[2] = -late, d[10] = 0.02 * 9.8;
  EXPECT_LT(shown(c, 1).share, 1e-6);
  EXPECT_GT(shown(c, 4).share, kShare);
}

TEST(FamilyDetectability, ReadsBeatsFromTheImu) {
  flightlog::FlightLog log;
  log.header.flapping_Hz = 34;
  log.header.imu.latency_s = 2e-3;
  const double w = 2 * std::numbers::pi * 34;
  for (int i = 0; i < 1000; ++i) {
    const double t = 1e-3 * i;
    log.imu.t_s.push_back(t + 2e-3);
    for (flightlog::Column* k :
         {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.gyro_x_rad_s, &log.imu.gyro_y_rad_s})
      k->push_back(0);
    log.imu.accel_z_m_s2.push_back(9.8 + 3 * std::cos(w * t) - 2 * std::sin(2 * w * t));
    log.imu.gyro_z_rad_s.push_back(0.5 * t + 0.1 * std::sin(w * t));
  }
  const Beats beats = beats_of(log, {0, 10 / 34.0, 5});
  ASSERT_TRUE(beats[1]);
  EXPECT_FALSE(beats[2]) << "after the end";
  const auto& b = *beats[1];
  for (const auto& [at, value] :
       {std::pair{10, 9.8}, {11, 3.0}, {12, 0.0}, {13, 0.0}, {14, -2.0}, {25, 0.5}, {26, 0.1 * w}, {27, 0.0}})
    EXPECT_NEAR(b[static_cast<std::size_t>(at)], value, 1e-6) << at;
}

}  // namespace
}  // namespace flappy::benchmark
