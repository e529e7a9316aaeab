#include "gap/evidence/evidence.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::evidence_test {
namespace {

// One coefficient of the basis in one group, by hand: as a regressor of prior mean m, and as the discrepancy.
TEST(Evidence, IntegratesOutInClosedForm) {
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 1);
  const SufficientStatistics s = evidence.statistics({made[0]->measured()}),
                             zero = evidence.statistics({Rows(made[0]->measured().size(), 0)});
  const int group = group_index(kSpecificForceX, 1), function = 2;
  const auto g = static_cast<std::size_t>(group);
  const BasisCoefficients none = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  BasisCoefficients unit = none;
  unit(group, function) = 1;
  SufficientStatistics of_unit = zero;
  evidence.add(1, unit, of_unit);
  const double a = of_unit.sums[0][g][function], b = s.sums[0][g][function];
  const double sd = 2 / std::sqrt(a), m = 0.7;
  const auto log_p = [&](const BasisCoefficients& discrepancy_sd, bool regressor) {
    const std::vector<const BasisCoefficients*> regressors(regressor ? 1 : 0, &unit);
    return Evidence::posterior(evidence.reduce(s, regressors, {1}, discrepancy_sd),
                               std::vector<int>(regressor ? 1 : 0, 0), Eigen::VectorXd::Constant(regressor ? 1 : 0, m))
        .log_evidence;
  };
  const double without = log_p(none, false);
  const double by_delta = 0.5 * b * b / (a + 1 / (sd * sd)) - 0.5 * std::log1p(a * sd * sd);
  const double by_regressor = -0.5 * (m * m - (b + m) * (b + m) / (a + 1)) - 0.5 * std::log1p(a);
  // sums of squares of some hundred rows, less each other
  const double error = 1e-11 * std::max(1.0, std::abs(without));
  EXPECT_NEAR(log_p(sd * unit, false) - without, by_delta, error);
  EXPECT_NEAR(log_p(none, true) - without, by_regressor, error);
  EXPECT_EQ(evidence.reduce(s, {&unit}, {0}, none).sums.norm(), 0) << "a flight that is left out";
  const Eigen::MatrixXd known = evidence.reduce(s, {&unit}, {1}, none).sums.topLeftCorner(1, 1);
  const auto each = evidence.reduce_each({s, {}}, {&unit}, {1}, none, &known);
  EXPECT_EQ(each[0]->sums, evidence.reduce(s, {&unit}, {1}, none).sums);
  EXPECT_FALSE(each[1]) << "no residual, no evidence";
}

// A residual of an autoregressive course: innovations of sd 0.05, of which 0.6 is remembered. 240 rows: 6 % of the sd, 0.05 of the memory; the
// median of innovations 8 %.
TEST(Evidence, LearnsTheNoise) {
  const auto made = synthetic_flights(2, synthetic_law);
  const Flights flights = as_flights(made);
  const Evidence declared(question_of(flights), flights, read_model_discrepancy(), 1);
  const int group = group_index(kSpecificForceZ, 0);
  EXPECT_NEAR(declared.noise_sd(group), SyntheticFlight::kNoise, 0.2 * SyntheticFlight::kNoise);
  Residuals residual;
  for (const auto& f : made) {
    Rows rows = f->noise(77, 0.05);
    for (std::size_t j = 1; j < f->beats(); ++j)
      for (std::size_t g = 0; g < kRowsPerBeat; ++g)
        rows[j * kRowsPerBeat + g] += 0.6 * rows[(j - 1) * kRowsPerBeat + g];
    residual.push_back(std::move(rows));
  }
  const double sd = 0.05 / std::sqrt(1 - 0.36);
  EXPECT_NEAR(declared.with_noise(residual).noise_sd(group), sd, 0.2 * sd);
  EXPECT_EQ(declared.with_weights(residual).noise_sd(group), declared.noise_sd(group));
  // what is smooth is no noise, unless it is all that is left
  const BasisCoefficients smooth = BasisCoefficients::Constant(kGroups, declared.basis().size(), -1);
  for (std::size_t f = 0; f < made.size(); ++f) residual[f] = declared.without(f, residual[f], smooth);
  EXPECT_NEAR(declared.with_noise(residual).noise_sd(group), sd, 0.2 * sd);
  EXPECT_GT(declared.with_rest_as_noise(residual).noise_sd(group), 10 * sd);
  // nor is any smaller than declared
  const Residuals nothing(2, Rows(made[0]->measured().size(), 0));
  EXPECT_NEAR(declared.with_noise(nothing).noise_sd(group), declared.noise_sd(group), 0.02 * SyntheticFlight::kNoise);
}

// Two flights in the air and two runs on a bench, whose noise is five times as large. 240 rows: as in LearnsTheNoise.
TEST(Evidence, KeepsABenchApartFromTheAir) {
  const auto made = synthetic_flights(4, synthetic_law);
  made[1]->on_bench = made[3]->on_bench = true;
  const Flights flights = as_flights(made);
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  for (std::size_t c = kChannels; c < kSettingChannels; ++c) {
    discrepancy.shares[c] = discrepancy.shares[c - kChannels];
    for (auto& of_harmonic : discrepancy.shares[c])
      for (double& share : of_harmonic) share *= 3;
  }
  const Evidence declared(question_of(flights), flights, discrepancy, 1);
  Residuals residual;
  for (const auto& f : made) residual.push_back(f->noise(77, f->on_bench ? 0.25 : 0.05));
  const Evidence evidence = declared.with_noise(residual);
  const int air = first_group(false, kSpecificForceZ), bench = first_group(true, kSpecificForceZ);
  EXPECT_NEAR(evidence.noise_sd(air), 0.05, 0.2 * 0.05);
  EXPECT_NEAR(evidence.noise_sd(bench), 0.25, 0.2 * 0.25);
  const SufficientStatistics s = evidence.statistics(residual);
  for (std::size_t f = 0; f < made.size(); ++f) {
    EXPECT_EQ(s.sums[f][static_cast<std::size_t>(air)].norm() > 0, !made[f]->on_bench) << f;
    EXPECT_EQ(s.sums[f][static_cast<std::size_t>(bench)].norm() > 0, made[f]->on_bench) << f;
  }
  const BasisCoefficients sd = evidence.discrepancy_sd({});
  EXPECT_NEAR(sd(bench, 0) / sd(air, 0), 3, 1e-9) << "signals are equal";
  // a change on the bench alone is none in the air
  BasisCoefficients change = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  change(bench, 0) = 1;
  EXPECT_EQ(evidence.without(0, residual[0], change), residual[0]);
  EXPECT_NE(evidence.without(1, residual[1], change), residual[1]);
  EXPECT_NE(evidence.block_of(air, 0), evidence.block_of(bench, 0));
}

TEST(Evidence, CountsRowsFarOffForLess) {
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 1);
  Rows spiked = made[0]->noise(5);
  const std::size_t row = 60 * kRowsPerBeat + static_cast<std::size_t>(group_index(kSpecificForceX, 0));
  spiked[row] += 100 * SyntheticFlight::kNoise;
  const auto moved = [&](const Evidence& e) {
    const auto g = static_cast<std::size_t>(group_index(kSpecificForceX, 0));
    Rows without = spiked;
    without[row] -= 100 * SyntheticFlight::kNoise;
    return std::abs(e.statistics({spiked}).sums[0][g][0] - e.statistics({without}).sums[0][g][0]);
  };
  // Student's t of 4 degrees of freedom: a row at t = 100 counts (4 + 1) / (4 + 100^2), but the beat after it remembers some of it
  EXPECT_LT(moved(evidence.with_weights({spiked})), 0.1 * moved(evidence));
}

TEST(Evidence, FindsTheSmoothPartOfRows) {
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const Evidence evidence(question_of(flights), flights, read_model_discrepancy(), 1);
  BasisCoefficients smooth = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  smooth(group_index(kSpecificForceZ, 1), 3) = 0.4;
  smooth(group_index(kAngularAccelerationY, 0), 1) = -2;
  const Rows rows = evidence.without(0, Rows(made[0]->measured().size(), 0), -smooth);
  // a ridge of 1e-6 takes as much of them
  EXPECT_NEAR((evidence.basis_coefficients({rows}) - smooth).cwiseAbs().maxCoeff(), 0, 1e-5);
  SufficientStatistics added = evidence.statistics({Rows(rows.size(), 0)});
  evidence.add(2, smooth, added);
  Rows twice = rows;
  for (double& r : twice) r *= 2;
  const SufficientStatistics s = evidence.statistics({twice});
  for (std::size_t g = 0; g < kGroups; ++g)
    EXPECT_NEAR((s.sums[0][g] - added.sums[0][g]).norm(), 0, 1e-9 * (1 + s.sums[0][g].norm())) << g;
}

TEST(Evidence, ScalesTheDiscrepancyByBlocks) {
  const auto made = synthetic_flights(1, synthetic_law);
  const Flights flights = as_flights(made);
  const ModelDiscrepancy discrepancy = read_model_discrepancy();
  const Evidence evidence(question_of(flights), flights, discrepancy, 1);
  const int group = group_index(kSpecificForceZ, 0);
  const BasisCoefficients sd = evidence.discrepancy_sd({});
  EXPECT_DOUBLE_EQ(sd(group, 1), evidence.signal(group) * discrepancy.share(kSpecificForceZ, 0, BasisFunction::input));
  Scales scales;
  scales.blocks.assign(kBlocks, 1);
  scales.blocks[static_cast<std::size_t>(evidence.block_of(group, 1))] = 3;
  const BasisCoefficients scaled = evidence.discrepancy_sd(scales);
  EXPECT_DOUBLE_EQ(scaled(group, 1), 3 * sd(group, 1));
  EXPECT_EQ(scaled(group, 0), sd(group, 0));
  EXPECT_EQ(scaled(group_index(kSpecificForceX, 0), 1), sd(group_index(kSpecificForceX, 0), 1));
}

}  // namespace
}  // namespace flappy::gap::evidence_test
