#include "gap/fit/fit.hpp"

#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::fit_test {
namespace {

class Fits : public testing::Test {
 protected:
  Fits() {
    const Hypothesis wind(priors_, {"wind"});
    Eigen::VectorXd at = wind.start();
    at[0] = 1.5;  // mass
    at[2] = 0.8;  // wind
    for (const auto& f : made_) f->fly(wind.vehicle(at));
  }
  const sim::Randomisation priors_ = synthetic_priors();
  std::vector<std::shared_ptr<SyntheticFlight>> made_ = synthetic_flights(2, synthetic_law);
  Flights flights_ = as_flights(made_);
  std::shared_ptr<const Evidence> evidence_ =
      std::make_shared<const Evidence>(question_of(flights_), flights_, read_model_discrepancy(), 1);
  Fitter fitter_{question_of(flights_), flights_, evidence_, 1};
};

// Rows of noise 0.01, 240 of which show a unit of mass as 0.1 amplitude: an sd of 0.01 / (0.1 sqrt(240)) = 0.0065 by noise alone, and what the
// model discrepancy of the vertical force with the amplitude may be, in units of 0.1, on top.
TEST_F(Fits, FindsParametersAndMagnitudes) {
  const Hypothesis wind(priors_, {"wind"});
  const Fit fit = fitter_.fit(wind, wind.start(), 4);
  ASSERT_TRUE(fit.flown());
  const Eigen::MatrixXd covariance = fit.covariance();
  EXPECT_NEAR(fit.mean()[0], 1.5, 4 * std::sqrt(covariance(0, 0)));
  EXPECT_NEAR(fit.mean()[2], 0.8, 4 * std::sqrt(covariance(2, 2)));
  EXPECT_LT(std::sqrt(covariance(0, 0)), 0.5) << "of a prior of 1";
  EXPECT_NEAR(covariance(3, 3), 1, 1e-6) << "wind from the side shows nowhere";
  // the parameters alone leave the wind
  const Hypothesis none(priors_, {});
  const Fit without = fitter_.fit(none, none.start(), 4);
  EXPECT_GT(fit.posterior.log_evidence, without.posterior.log_evidence + 10);
}

// The law is linear in the mass and the wind, so differences of any kind are the slope; also at a bound of the wind,
// where the only side is downward.
TEST_F(Fits, TakesColumnsByForwardDifferences) {
  const Hypothesis wind(priors_, {"wind"});
  for (const double far : {0.0, 100.0}) {
    const Eigen::VectorXd at = wind.bounded(wind.start() + far * Eigen::VectorXd::Unit(wind.size(), 2));
    const Fit central = fitter_.linearise(wind, at, Fitter::axes(wind)),
              forward = fitter_.linearise(wind, at, Fitter::axes(wind), {}, true);
    for (const std::size_t d : {0, 2}) {
      const BasisCoefficients &both_sides = central.columns[d], &one_side = forward.columns[d];
      ASSERT_GT(both_sides.norm(), 1e-3);
      EXPECT_LT((one_side - both_sides).norm(), 1e-9 * both_sides.norm()) << far << ", " << d;
    }
    EXPECT_EQ(forward.residual, central.residual);
  }
}

TEST_F(Fits, FitsEffectsWhereTheParametersStay) {
  const Hypothesis none(priors_, {}), wind(priors_, {"wind"});
  const Fit parameters = fitter_.fit(none, none.start(), 4);
  const Fit fit = fitter_.fit_effects(wind, wind.start(), parameters);
  EXPECT_EQ(fit.at.head(none.size()), parameters.at);
  EXPECT_NEAR(fit.mean()[2], 0.8, 4 * std::sqrt(fit.covariance()(2, 2)));
  const Fit jointly = fitter_.fit_given(wind, wind.start(), parameters, 4);
  EXPECT_NEAR(jointly.mean()[2], fit.mean()[2], std::sqrt(fit.covariance()(2, 2)));
  // linear, from columns that are given: nothing is flown
  std::vector<BasisCoefficients> columns(static_cast<std::size_t>(wind.size() - wind.shared()));
  columns[0] = fit.columns[2];
  const std::size_t before = made_[0]->predicted;
  const Fit linear = fitter_.fit_linear(wind, parameters, columns);
  EXPECT_EQ(made_[0]->predicted, before);
  EXPECT_FALSE(linear.flown());
  EXPECT_NEAR(linear.mean()[2], 0.8, 4 * std::sqrt(linear.covariance()(2, 2)));
}

// In a contrast. The wind acts as c + 3 c^2. Over the first differences, to 0.3 on both sides, the slope is that at 0, by which 0.15 looks
// like 0.15 + 3 * 0.15^2 = 0.22.
TEST_F(Fits, FollowsAMagnitudeThatBends) {
  const Hypothesis none(priors_, {}), wind(priors_, {"wind"});
  const double unit = unknowns_of("wind")[0].scale;
  auto made = synthetic_flights(4, [unit](const SyntheticFlight& f, const VehicleHypothesis& h, Rows& rows) {
    const double c = value_of(h, "wind", "x_m_s") / unit;
    f.add(kSpecificForceX, 0, 5 * unit * (c + 3 * c * c) * f.velocity, rows);
  });
  Eigen::VectorXd at = wind.start();
  for (std::size_t f = 0; f < made.size(); ++f) {
    at[2] = f < 2 ? 0 : 0.15;
    made[f]->fly(wind.vehicle(at));
  }
  const Flights flights = as_flights(made, 2);
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.session = read_session_variation();
  const Fitter fitter(question_of(flights), flights,
                      std::make_shared<const Evidence>(question_of(flights), flights, discrepancy, 1), 1);
  const Fit fit = fitter.fit_effects(wind, wind.start(), fitter.fit(none, none.start(), 4));
  EXPECT_NEAR(fit.mean()[2], 0.15, 0.02);
}

TEST_F(Fits, FliesNoLinearMagnitude) {
  const Hypothesis none(priors_, {}), wind(priors_, {"wind"});
  const Fit parameters = fitter_.fit(none, none.start(), 4);
  const BasisCoefficients given = BasisCoefficients::Constant(kGroups, evidence_->basis().size(), 0.5);
  const Fitter with = fitter_.with_linear_magnitudes({{{"wind", "y_m_s"}, given}});
  const Fit fit = with.linearise(wind, wind.start(), Fitter::axes(wind));
  EXPECT_EQ(*fit.columns[3], given);
  EXPECT_NE(*fit.columns[2], given);
}

// A vehicle that comes apart with the second step has no column there, and no residual where it starts.
TEST_F(Fits, KnowsWhereAVehicleComesApart) {
  auto fragile = std::make_shared<SyntheticFlight>(
      "fragile", 1, [](const SyntheticFlight& f, const VehicleHypothesis& h, Rows& rows) {
        if (value_of(h, "wind", "x_m_s") > 0.01) rows.clear();
        else synthetic_law(f, h, rows);
      });
  const Flights flights{{}, {fragile}};
  const Fitter fitter(question_of(flights), flights,
                      std::make_shared<const Evidence>(question_of(flights), flights, read_model_discrepancy(), 1), 1);
  const Hypothesis wind(priors_, {"wind"});
  const Fit fit = fitter.linearise(wind, wind.start(), Fitter::axes(wind));
  ASSERT_TRUE(fit.flown());
  EXPECT_EQ(fit.columns[2].size(), 0);
  EXPECT_GT(fit.columns[0].size(), 0);
  Eigen::VectorXd at = wind.start();
  at[2] = 1;
  EXPECT_FALSE(fitter.fit(wind, at, 4).flown());
}

// Nuisance regressors take their part; background magnitudes do so with the scales of the robot, or are left out.
TEST_F(Fits, IsGivenNuisances) {
  const Hypothesis none(priors_, {});
  const Fit parameters = fitter_.fit(none, none.start(), 4);
  BasisCoefficients wind = BasisCoefficients::Zero(kGroups, evidence_->basis().size()), unseen = wind;
  const int velocity = 2;
  ASSERT_EQ(evidence_->basis().name(velocity), "velocity_x");
  wind(group_index(kSpecificForceX, 0), velocity) = 0.1;
  Regressors nuisances;
  nuisances.add(unseen, 0);
  nuisances.add(wind, 0);
  const Fitter with = fitter_.with_nuisances(nuisances, {{"wind", wind}}, parameters);
  ASSERT_EQ(with.nuisances(parameters).size(), 1u) << "of the other the flights say nothing";
  EXPECT_EQ(with.nuisances(parameters)[0].place, 1u);
  EXPECT_GT(with.nuisances(parameters)[0].mean, 0.5);
  EXPECT_EQ(with.place_of("wind"), 0);
  EXPECT_EQ(with.place_of("tether"), -1);
  Scales scales;
  scales.effects = {4};
  const Fitter scaled = with.with_scales(scales);
  const std::vector<const BasisCoefficients*> columns = scaled.regressors(parameters).columns;
  EXPECT_EQ(*columns.back(), 4 * wind);
  EXPECT_EQ(*scaled.unscaled_regressors(parameters).columns.back(), wind);
  const Fitter::JointFit all = scaled.joint_fit(none, parameters, {1, 1}),
                         bare = scaled.without_background().joint_fit(none, parameters, {1, 1});
  EXPECT_GT(all.nuisances.norm(), bare.nuisances.norm());
  ASSERT_EQ(bare.means.size(), 1u);
  ASSERT_EQ(all.means.size(), 2u);
  EXPECT_EQ(all.means[1].place, 2u) << "after both nuisances";
  const double both = all.means[0].mean + all.means[1].mean;  // of the same column, whatever its scale
  EXPECT_NEAR((all.nuisances - both * wind).norm(), 0, 1e-9 * all.nuisances.norm());
}

// The law of an effect that acts by the place may deviate along the functions of the place that its change follows: each load of the body by the rms
// of the loads, times the law factor where the change follows most; no other function or channel. An effect that follows inputs, or a sensor, does not.
TEST_F(Fits, LawsOfWhatActsByThePlaceMayDeviate) {
  const Hypothesis ground(priors_, {"ground_effect"});
  const RegimeBasis& basis = evidence_->basis();
  const int amplitude = 1, height = 3, time = 4;
  ASSERT_EQ(basis.name(height), "height");
  const auto change = [&](int function) {
    Fit fit;
    fit.at = Eigen::VectorXd::Zero(ground.size());
    const BasisCoefficients none = BasisCoefficients::Zero(kGroups, basis.size());
    fit.columns.assign(static_cast<std::size_t>(ground.size()), none);
    fit.at[ground.shared()] = 2;
    const int lift = group_index(kSpecificForceZ, 0);
    BasisCoefficients own = none;
    own(lift, function) = 0.3 * evidence_->signal(lift);
    fit.columns[static_cast<std::size_t>(ground.shared())] = std::move(own);
    return fit;
  };
  Fit fit = change(height);
  // a twenty-fifth of the square, as by chance
  BasisCoefficients more = fit.columns[static_cast<std::size_t>(ground.shared())];
  more(group_index(kSpecificForceZ, 0), time) = 0.2 * 0.3 * evidence_->signal(group_index(kSpecificForceZ, 0));
  fit.columns[static_cast<std::size_t>(ground.shared())] = std::move(more);
  ASSERT_TRUE(fitter_.law_may_deviate(ground, fit));
  // groups of loads with a signal: six, of which three channels have a mean and a harmonic
  double loads = 0;
  for (int g = 0; g < group_index(kSpecificForceZ, kCoefficients); ++g) loads += evidence_->signal(g) > 0 ? 1 : 0;
  const double rms = 2 * 0.3 / std::sqrt(loads);
  for (const double factor : {1.0, 4.0}) {
    const BasisCoefficients sd = fitter_.law_sd(ground, fit, factor);
    for (const int g :
         {group_index(kSpecificForceX, 0), group_index(kAngularAccelerationY, 1), group_index(kSpecificForceZ, 0)}) {
      EXPECT_NEAR(sd(g, height), factor * rms * evidence_->signal(g), 1e-12) << g;
      EXPECT_NEAR(sd(g, time), 0.2 * rms * evidence_->signal(g), 1e-12) << g;
      EXPECT_EQ(sd(g, amplitude), 0);
    }
    EXPECT_EQ(sd.bottomRows(kGroups - group_index(kSpecificForceZ, kCoefficients)).maxCoeff(), 0)
        << "strokes, motion capture";
  }
  EXPECT_FALSE(fitter_.law_may_deviate(ground, change(amplitude)));
  const Hypothesis tilt(priors_, {"mocap_tilt"});
  Fit turned;
  turned.at = Eigen::VectorXd::Ones(tilt.size());
  turned.columns.assign(static_cast<std::size_t>(tilt.size()), fit.columns[static_cast<std::size_t>(ground.shared())]);
  EXPECT_FALSE(fitter_.law_may_deviate(tilt, turned));
}

}  // namespace
}  // namespace flappy::gap::fit_test
